// SPDX-License-Identifier: Apache-2.0
/// PGM and PPM images (P2, P3, P5, P6; maxval to 65535).
/// Source: the netpbm manual pages pgm(5) and ppm(5).
#ifndef VERGENCE_DAEMON_IMAGES_IMAGE_PNM_H
#define VERGENCE_DAEMON_IMAGES_IMAGE_PNM_H

#include "daemon/images/image_file.h"

#ifdef __cplusplus
extern "C" {
#endif

/// See struct image_format.
bool image_pnm_probe(const unsigned char *head, size_t length);
int image_pnm_read(const char *path, const struct image_request *request, struct image_file *file,
                   struct message *message);

/// Parses a whole file in memory into `file`, whose path and request are set. If maxval is 2^n - 1
/// (n from 8 to 16: n bits) the values are taken unchanged, else they are stretched to the next
/// such range. ERROR_SYNTAX, and errors of `image_file_begin` and `image_file_row`.
int image_pnm_parse(const unsigned char *data, size_t length, struct image_file *file,
                    struct message *message);

#ifdef __cplusplus
}
#endif

#endif

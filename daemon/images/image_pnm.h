// SPDX-License-Identifier: Apache-2.0
/// Formats that need no library: PGM and PPM images (P2, P3, P5, P6; maxval to 65535).
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

/// Headerless frames in the sensor's format: little-endian 16 bit words with 10 significant bits, a
/// GRBG mosaic, row by row (Aptina MT9T001 data sheet: 2048x1536 active pixels).
enum { IMAGE_RAW_WIDTH_PX = 2048, IMAGE_RAW_HEIGHT_PX = 1536, IMAGE_RAW_BITS = 10 };

/// See struct image_format. There is no probe, as the format has no signature.
int image_raw_read(const char *path, const struct image_request *request, struct image_file *file,
                   struct message *message);

/// Parses a whole file in memory into `file`, whose path and request are set. ERROR_SYNTAX if the
/// length does not match the size; ERROR_RANGE if a word has more bits than allowed.
int image_raw_parse(const unsigned char *data, size_t length, struct image_file *file,
                    struct message *message);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// Headerless frames in the sensor's format: little-endian 16 bit words with 10 significant bits, a
/// GRBG mosaic, row by row (Aptina MT9T001 data sheet: 2048x1536 active pixels).
#ifndef VERGENCE_DAEMON_IMAGES_IMAGE_RAW_H
#define VERGENCE_DAEMON_IMAGES_IMAGE_RAW_H

#include "daemon/images/image_file.h"

#ifdef __cplusplus
extern "C" {
#endif

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

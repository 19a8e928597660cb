// SPDX-License-Identifier: Apache-2.0
/// PNG images of every kind: grey, colour and palette, 1 to 16 bit, interlaced or not. Alpha is
/// dropped; a truncated file or a wrong checksum is rejected.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_IMAGE_PNG_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_IMAGE_PNG_HPP

#include "daemon/images/image_file.h"

/// See struct image_format.
bool image_png_probe(const unsigned char *head, size_t length);
int image_png_read(const char *path, const image_request *request, image_file *file,
                   message *message);

#endif

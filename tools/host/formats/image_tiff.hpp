// SPDX-License-Identifier: Apache-2.0
/// TIFF images: 8 or 16 bit, grey or RGB (alpha dropped), in strips or tiles, any compression that
/// libtiff supports. Other kinds are rejected by name.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_IMAGE_TIFF_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_IMAGE_TIFF_HPP

#include "daemon/images/image_file.h"

/// See struct image_format.
bool image_tiff_probe(const unsigned char *head, size_t length);
int image_tiff_read(const char *path, const image_request *request, image_file *file,
                    message *message);

#endif

// SPDX-License-Identifier: Apache-2.0
/// JPEG images, 8 bit grey or colour, baseline or progressive; and the encoder for textures. Data
/// that the decoder would have to guess (a truncated file, damaged codes) and CMYK are rejected.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_IMAGE_JPEG_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_IMAGE_JPEG_HPP

#include <vector>

#include "daemon/images/image_file.h"

/// See struct image_format.
bool image_jpeg_probe(const unsigned char *head, size_t length);
int image_jpeg_read(const char *path, const image_request *request, image_file *file,
                    message *message);

/// A whole JPEG file in memory of `image` at `quality` 0..100; empty when memory runs out.
std::vector<unsigned char> image_jpeg_encode(const image_rgb8 &image, int quality);

#endif

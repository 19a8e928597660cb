// SPDX-License-Identifier: Apache-2.0
/// All image formats that the host reads, in one list.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_IMAGE_FORMATS_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_IMAGE_FORMATS_HPP

#include <cstddef>
#include <vector>

#include "daemon/images/image_file.h"

struct image_format_list {
    const image_format *first;
    int count;
};

/// Static storage.
image_format_list image_formats();

/// PNG images of every kind: grey, colour and palette, 1 to 16 bit, interlaced or not. Alpha is
/// dropped; a truncated file or a wrong checksum is rejected.

/// See struct image_format.
bool image_png_probe(const unsigned char *head, size_t length);
int image_png_read(const char *path, const image_request *request, image_file *file,
                   message *message);

/// JPEG images, 8 bit grey or colour, baseline or progressive; and the encoder for textures. Data
/// that the decoder would have to guess (a truncated file, damaged codes) and CMYK are rejected.

/// See struct image_format.
bool image_jpeg_probe(const unsigned char *head, size_t length);
int image_jpeg_read(const char *path, const image_request *request, image_file *file,
                    message *message);

/// A whole JPEG file in memory of `image` at `quality` 0..100; empty when memory runs out.
std::vector<unsigned char> image_jpeg_encode(const image_rgb8 &image, int quality);

/// TIFF images: 8 or 16 bit, grey or RGB (alpha dropped), in strips or tiles, any compression that
/// libtiff supports. Other kinds are rejected by name.

/// See struct image_format.
bool image_tiff_probe(const unsigned char *head, size_t length);
int image_tiff_read(const char *path, const image_request *request, image_file *file,
                    message *message);

/// The orientation of an image from its EXIF data. Source: CIPA DC-008, "Exchangeable image file
/// format for digital still cameras" (EXIF 2.3), section 4.6; its blocks are laid out as TIFF 6.0.

/// The orientation 1..8 (see struct image_file) in the first directory of an EXIF block, which
/// begins with the byte order; 0 when it has none or is damaged.
int exif_orientation(const unsigned char *data, std::size_t length);

#endif

// SPDX-License-Identifier: Apache-2.0
/// The orientation of an image from its EXIF data. Source: CIPA DC-008, "Exchangeable image file
/// format for digital still cameras" (EXIF 2.3), section 4.6; its blocks are laid out as TIFF 6.0.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_EXIF_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_EXIF_HPP

#include <cstddef>

/// The orientation 1..8 (see struct image_file) in the first directory of an EXIF block, which
/// begins with the byte order; 0 when it has none or is damaged.
int exif_orientation(const unsigned char *data, std::size_t length);

#endif

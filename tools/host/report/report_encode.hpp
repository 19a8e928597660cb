// SPDX-License-Identifier: Apache-2.0
/// Encodes bytes and pictures for one self-contained page.
#ifndef VERGENCE_TOOLS_HOST_REPORT_REPORT_ENCODE_HPP
#define VERGENCE_TOOLS_HOST_REPORT_REPORT_ENCODE_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "stereo/image/image.h"
#include "tools/host/formats/colormap.hpp"

using report_bytes = std::vector<unsigned char>;

std::string report_encode_base64(const report_bytes &bytes);

/// zlib stream (RFC 1950); empty when memory is short.
report_bytes report_encode_deflate(const report_bytes &bytes);

/// Palette index of a transparent pixel: nothing was measured there.
enum { REPORT_TRANSPARENT = 255 };

/// `data:` URI of a palette PNG of width x height indices; empty on failure. Indices
/// 0..254 have the colours of `palette`, REPORT_TRANSPARENT is transparent.
std::string report_encode_png(int width_px, int height_px, const report_bytes &indices,
                              const colormap_table &palette);

/// `data:` URI of a JPEG of a colour image (quality 0..100); empty on failure.
std::string report_encode_jpeg(const image_rgb8 &image, int quality);

#endif

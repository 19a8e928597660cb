// SPDX-License-Identifier: Apache-2.0
/// The measurement as passed to the page's scripts, and the pictures' pixels. Large images are
/// subsampled by an integer factor to limit the file size.
#ifndef VERGENCE_TOOLS_HOST_REPORT_REPORT_LAYERS_HPP
#define VERGENCE_TOOLS_HOST_REPORT_REPORT_LAYERS_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "stereo/image/image.h"
#include "tools/host/formats/colormap.hpp"
#include "tools/host/report/report_figures.hpp"

using report_bytes = std::vector<unsigned char>;

/// The grid of the page: every `step`-th pixel of the rectified images, from (0, 0).
struct report_grid {
    int step, width_px, height_px;
};

report_grid report_layers_grid(const reconstruct_result &result);

/// Base64 of a zlib stream of the layers, each a plane of width x height bytes from the top row:
/// disparity (three planes: low, middle, high byte of the difference from the pixel to the left, 24
/// bits, 1/256 px; an invalid pixel repeats its left neighbour), reason, confidence (in 16 steps:
/// finer ones are noise that would fill the file), sigma of the disparity (1/256 px to three
/// leading bits, for the same reason; 255 and more as 255), sigma along the ray
/// (`report_layers_sigma_code`), and with truth its disparity (three planes; 0x7fffff: unknown).
/// Empty when memory is short.
std::string report_layers_pack(const reconstruct_result &result, const report_truth &truth,
                               const report_grid &grid);

/// Logarithmic code of a length: 0 for 0, else first * ratio^(code - 1).
constexpr double report_layers_sigma_first_mm = 1e-3;
constexpr double report_layers_sigma_ratio = 1.0655;
int report_layers_sigma_code(double sigma_mm);

/// A colour picture as a JPEG `data:` URI, reduced by averaging areas of step x step pixels.
std::string report_layers_photo(const image_rgb8 &image, int step);

/// Palette indices of the page's pixels for each picture.
report_bytes report_layers_disparity(const reconstruct_result &result, const report_grid &grid,
                                     double low_px, double high_px);
report_bytes report_layers_reason(const reconstruct_result &result, const report_grid &grid);
report_bytes report_layers_confidence(const reconstruct_result &result, const report_grid &grid);
report_bytes report_layers_sigma(const reconstruct_result &result, const report_grid &grid,
                                 double high_px);
report_bytes report_layers_error(const reconstruct_result &result, const report_truth &truth,
                                 const report_grid &grid, double limit_px);

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

// SPDX-License-Identifier: Apache-2.0
#include "tools/host/report/report_layers.hpp"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/base64.h"
#include "daemon/surface/result/result_figures.h"
#include "tools/host/formats/image_formats.hpp"
#include "tools/host/formats/write_png.hpp"

namespace {

/// Maximum number of pixels on the page: about 4 bytes each once packed and encoded.
constexpr double max_page_pixels = 1.45e6;

constexpr std::int32_t no_truth = 0x7fffff;

struct sample {
    int x, y;        // pixel of the rectified left image
    std::size_t at;  // index in the page's planes
};

/// Calls visit(sample) for every pixel of the page.
template <typename Visit>
void for_each_sample(const report_grid &grid, Visit visit) {
    std::size_t at = 0;
    for (int y = 0; y < grid.height_px; y++) {
        for (int x = 0; x < grid.width_px; x++) {
            visit(sample{x * grid.step, y * grid.step, at++});
        }
    }
}

std::size_t page_pixels(const report_grid &grid) {
    return static_cast<std::size_t>(grid.width_px) * static_cast<std::size_t>(grid.height_px);
}

bool is_valid(const reconstruct_result &result, const sample &s) {
    return reason_has_disparity(image_u8_row(&result.match.reason, s.y)[s.x]);
}

std::int32_t disparity_q8(const reconstruct_result &result, const sample &s) {
    return image_i32_row(&result.match.disparity_q8, s.y)[s.x];
}

std::size_t pixel_of(const reconstruct_result &result, const sample &s) {
    return static_cast<std::size_t>(s.y) * static_cast<std::size_t>(result.left.width) +
           static_cast<std::size_t>(s.x);
}

/// Appends three planes of row-wise differences of 24-bit values.
void append_differences(const report_grid &grid, const std::vector<std::int32_t> &values,
                        report_bytes *bytes) {
    const std::size_t pixels = values.size(), begin = bytes->size();
    const std::size_t width = static_cast<std::size_t>(grid.width_px);
    bytes->resize(begin + 3 * pixels);
    for (std::size_t i = 0; i < pixels; i++) {
        const std::int32_t before = i % width == 0 ? 0 : values[i - 1];
        const std::uint32_t difference = static_cast<std::uint32_t>(values[i] - before);
        for (std::size_t plane = 0; plane < 3; plane++) {
            (*bytes)[begin + plane * pixels + i] =
                static_cast<unsigned char>(difference >> (8 * plane));
        }
    }
}

std::vector<std::int32_t> disparities(const reconstruct_result &result, const report_grid &grid) {
    std::vector<std::int32_t> values(page_pixels(grid), 0);
    for_each_sample(grid, [&](const sample &s) {
        if (is_valid(result, s)) {
            values[s.at] = disparity_q8(result, s);
        } else if (s.x > 0) {
            values[s.at] = values[s.at - 1];
        }
    });
    return values;
}

std::vector<std::int32_t> truths(const reconstruct_result &result, const report_truth &truth,
                                 const report_grid &grid) {
    std::vector<std::int32_t> values(page_pixels(grid), no_truth);
    for_each_sample(grid, [&](const sample &s) {
        const float value = truth.disparity_px[pixel_of(result, s)];
        if (std::isfinite(value) && std::fabs(value) < 16384) {
            values[s.at] = static_cast<std::int32_t>(std::lround(256 * value));
        }
    });
    return values;
}

/// Index 0..254 of `share` in [0, 1] of the palette, clamped at the ends.
unsigned char palette_index(double share) {
    return static_cast<unsigned char>(std::lround(254 * std::min(1.0, std::max(0.0, share))));
}

/// The same in steps that still look smooth: noisy maps compress twice as well.
unsigned char coarse_index(double share) {
    return static_cast<unsigned char>(8 * (palette_index(share) / 8) + (share < 0.5 ? 0 : 6));
}

/// A value to its three leading bits, at most 255: the precision that its own uncertainty
/// justifies.
unsigned char leading_bits(unsigned value) {
    unsigned shift = 0;
    while (value >> shift > 7) {
        shift++;
    }
    const unsigned rounded = (value + (1u << shift) / 2) >> shift << shift;
    return static_cast<unsigned char>(std::min(255u, rounded));
}

}  // namespace

report_grid report_layers_grid(const reconstruct_result &result) {
    int step = 1;
    while (static_cast<double>(result.left.width) * result.left.height >
           max_page_pixels * step * step) {
        step++;
    }
    return {step, (result.left.width + step - 1) / step, (result.left.height + step - 1) / step};
}

int report_layers_sigma_code(double sigma_mm) {
    if (!(sigma_mm > 0)) {
        return 0;
    }
    const double code =
        1 + std::log(sigma_mm / report_layers_sigma_first_mm) / std::log(report_layers_sigma_ratio);
    return static_cast<int>(std::lround(std::min(255.0, std::max(1.0, code))));
}

std::string report_layers_pack(const reconstruct_result &result, const report_truth &truth,
                               const report_grid &grid) {
    const std::size_t pixels = page_pixels(grid);
    report_bytes bytes;
    bytes.reserve((truth.disparity_px.empty() ? 7 : 10) * pixels);
    append_differences(grid, disparities(result, grid), &bytes);
    report_bytes reason(pixels), confidence(pixels), sigma(pixels), reach(pixels);
    std::vector<unsigned char> sigma_code(static_cast<std::size_t>(result.left.width) *
                                          static_cast<std::size_t>(result.left.height));
    for (std::uint32_t i = 0; i < result.vertex_count; i++) {
        if (surface_figures_is_filled(&result, result.vertex_pixel[i])) {
            continue;
        }
        sigma_code[result.vertex_pixel[i]] =
            static_cast<unsigned char>(report_layers_sigma_code(1e-3 * result.points[i].sigma_um));
    }
    for_each_sample(grid, [&](const sample &s) {
        reason[s.at] = image_u8_row(&result.match.reason, s.y)[s.x];
        const int level = image_u8_row(&result.match.confidence, s.y)[s.x] / 16;
        confidence[s.at] = static_cast<unsigned char>(level * 17);
        sigma[s.at] = leading_bits(subpixel_sigma_q8(image_u8_row(&result.sigma, s.y)[s.x]));
        reach[s.at] = sigma_code[pixel_of(result, s)];
    });
    for (const report_bytes *plane : {&reason, &confidence, &sigma, &reach}) {
        bytes.insert(bytes.end(), plane->begin(), plane->end());
    }
    if (!truth.disparity_px.empty()) {
        append_differences(grid, truths(result, truth, grid), &bytes);
    }
    return report_encode_base64(report_encode_deflate(bytes));
}

std::string report_layers_photo(const image_rgb8 &image, int step) {
    const int width = (image.width + step - 1) / step, height = (image.height + step - 1) / step;
    const std::size_t row_bytes = 3 * static_cast<std::size_t>(width);
    report_bytes small(row_bytes * static_cast<std::size_t>(height));
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const int x_end = std::min(image.width, (x + 1) * step);
            const int y_end = std::min(image.height, (y + 1) * step);
            unsigned sum[3] = {0, 0, 0}, count = 0;
            for (int v = y * step; v < y_end; v++) {
                for (int u = x * step; u < x_end; u++, count++) {
                    for (int c = 0; c < 3; c++) {
                        sum[c] += image_rgb8_row(&image, v)[3 * u + c];
                    }
                }
            }
            for (std::size_t c = 0; c < 3; c++) {
                small[static_cast<std::size_t>(y) * row_bytes + 3 * static_cast<std::size_t>(x) +
                      c] = static_cast<unsigned char>((sum[c] + count / 2) / count);
            }
        }
    }
    const image_rgb8 view = {small.data(), width, height, static_cast<std::ptrdiff_t>(row_bytes)};
    return report_encode_jpeg(view, 86);
}

report_bytes report_layers_disparity(const reconstruct_result &result, const report_grid &grid,
                                     double low_px, double high_px) {
    report_bytes indices(page_pixels(grid), REPORT_TRANSPARENT);
    for_each_sample(grid, [&](const sample &s) {
        if (is_valid(result, s)) {
            indices[s.at] =
                palette_index((disparity_q8(result, s) / 256.0 - low_px) / (high_px - low_px));
        }
    });
    return indices;
}

report_bytes report_layers_reason(const reconstruct_result &result, const report_grid &grid) {
    report_bytes indices(page_pixels(grid));
    for_each_sample(grid, [&](const sample &s) {
        indices[s.at] = image_u8_row(&result.match.reason, s.y)[s.x];
    });
    return indices;
}

report_bytes report_layers_confidence(const reconstruct_result &result, const report_grid &grid) {
    report_bytes indices(page_pixels(grid), REPORT_TRANSPARENT);
    for_each_sample(grid, [&](const sample &s) {
        if (is_valid(result, s)) {
            indices[s.at] = coarse_index(image_u8_row(&result.match.confidence, s.y)[s.x] / 255.0);
        }
    });
    return indices;
}

report_bytes report_layers_sigma(const reconstruct_result &result, const report_grid &grid,
                                 double high_px) {
    report_bytes indices(page_pixels(grid), REPORT_TRANSPARENT);
    for_each_sample(grid, [&](const sample &s) {
        if (is_valid(result, s)) {
            indices[s.at] = coarse_index(subpixel_sigma_q8(image_u8_row(&result.sigma, s.y)[s.x]) /
                                         256.0 / high_px);
        }
    });
    return indices;
}

report_bytes report_layers_error(const reconstruct_result &result, const report_truth &truth,
                                 const report_grid &grid, double limit_px) {
    report_bytes indices(page_pixels(grid), REPORT_TRANSPARENT);
    for_each_sample(grid, [&](const sample &s) {
        const double wanted = truth.disparity_px[pixel_of(result, s)];
        const bool known =
            std::isfinite(wanted) && (truth.mask.empty() || truth.mask[pixel_of(result, s)] != 0);
        if (known && is_valid(result, s)) {
            indices[s.at] =
                coarse_index(0.5 + 0.5 * (disparity_q8(result, s) / 256.0 - wanted) / limit_px);
        }
    });
    return indices;
}

std::string report_encode_base64(const report_bytes &bytes) {
    std::string text(BASE64_TEXT_BYTES(bytes.size()), '\0');
    base64_encode(bytes.data(), bytes.size(), text.data());
    text.pop_back();  // the terminating zero
    return text;
}

report_bytes report_encode_deflate(const report_bytes &bytes) {
    uLongf size = compressBound(static_cast<uLong>(bytes.size()));
    report_bytes packed(size);
    if (compress2(packed.data(), &size, bytes.data(), static_cast<uLong>(bytes.size()), 6) !=
        Z_OK) {
        return {};
    }
    packed.resize(size);
    return packed;
}

std::string report_encode_png(int width_px, int height_px, const report_bytes &indices,
                              const colormap_table &palette) {
    const report_bytes bytes =
        write_png_bytes(width_px, height_px, indices, palette, REPORT_TRANSPARENT);
    return bytes.empty() ? "" : "data:image/png;base64," + report_encode_base64(bytes);
}

std::string report_encode_jpeg(const image_rgb8 &image, int quality) {
    const report_bytes bytes = image_jpeg_encode(image, quality);
    return bytes.empty() ? "" : "data:image/jpeg;base64," + report_encode_base64(bytes);
}

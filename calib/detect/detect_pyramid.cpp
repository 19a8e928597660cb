// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_pyramid.hpp"

#include <algorithm>

#include "core/invariant.h"

namespace calib::detect {

namespace {

constexpr int shortest_side_px = 32;

plane scaled_copy(const image_u8 &image) {
    INVARIANT(image.width > 0 && image.height > 0);
    plane made;
    made.width = image.width;
    made.height = image.height;
    made.pixels.reserve(static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
    for (int y = 0; y < image.height; y++) {
        const uint8_t *row = image_u8_row(&image, y);
        std::transform(row, row + image.width, std::back_inserter(made.pixels),
                       [](uint8_t grey) { return static_cast<uint16_t>(grey * pixel_scale); });
    }
    return made;
}

plane halved(const plane &from) {
    INVARIANT(from.pixels.size() ==
              static_cast<size_t>(from.width) * static_cast<size_t>(from.height));
    plane made;
    made.width = from.width / 2;
    made.height = from.height / 2;
    made.pixels.resize(static_cast<size_t>(made.width) * static_cast<size_t>(made.height));
    uint16_t *to = made.pixels.data();
    for (int y = 0; y < made.height; y++) {
        const uint16_t *upper = from.row(2 * y), *lower = from.row(2 * y + 1);
        for (int x = 0; x < made.width; x++) {
            const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
            *to++ = static_cast<uint16_t>((sum + 2) >> 2);
        }
    }
    return made;
}

// Along rows, transposed: applied twice it filters both ways. Pixels beyond the border repeat the
// last one.
plane filtered_and_turned(const plane &from) {
    plane made;
    made.width = from.height;
    made.height = from.width;
    made.pixels.resize(from.pixels.size());
    std::vector<int> padded(static_cast<size_t>(from.width) + 4);
    for (int y = 0; y < from.height; y++) {
        const uint16_t *row = from.row(y);
        std::copy(row, row + from.width, padded.begin() + 2);
        padded[0] = padded[1] = row[0];
        padded[padded.size() - 1] = padded[padded.size() - 2] = row[from.width - 1];
        const int *at = padded.data();
        uint16_t *to = made.pixels.data() + y;
        for (int x = 0; x < from.width; x++, at++, to += from.height) {
            *to = static_cast<uint16_t>((at[0] + at[4] + 4 * (at[1] + at[3]) + 6 * at[2] + 8) >> 4);
        }
    }
    return made;
}

}  // namespace

double plane::between(double x, double y) const {
    const int column = static_cast<int>(x), line = static_cast<int>(y);
    const double fx = x - column, fy = y - line;
    const uint16_t *upper = row(line) + column, *lower = row(line + 1) + column;
    const double top = upper[0] + fx * (upper[1] - upper[0]);
    const double bottom = lower[0] + fx * (lower[1] - lower[0]);
    return top + fy * (bottom - top);
}

bool plane::holds(double x, double y, double margin) const {
    return x - margin >= 0 && y - margin >= 0 && x + margin < width - 1 && y + margin < height - 1;
}

std::vector<plane> pyramid_of(const image_u8 &image) {
    std::vector<plane> levels;
    levels.push_back(scaled_copy(image));
    while (std::min(levels.back().width, levels.back().height) / 2 >= shortest_side_px) {
        levels.push_back(halved(levels.back()));
    }
    return levels;
}

std::vector<plane> smoothed(const std::vector<plane> &levels, int times) {
    std::vector<plane> made;
    for (const plane &level : levels) {
        made.push_back(level);
        for (int i = 0; i < times; i++) {
            made.back() = filtered_and_turned(filtered_and_turned(made.back()));
        }
    }
    return made;
}

}  // namespace calib::detect

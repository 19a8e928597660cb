// SPDX-License-Identifier: Apache-2.0
/// The image at full, half, quarter ... size. Each level averages 2x2 pixels of the previous one,
/// so blur and noise shrink and a large board becomes a small one.
#ifndef VERGENCE_CALIB_DETECT_DETECT_PYRAMID_HPP
#define VERGENCE_CALIB_DETECT_DETECT_PYRAMID_HPP

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stereo/image/image.h"

namespace calib::detect {

/// Pixels are grey levels times this, so that averages keep their fraction.
constexpr int pixel_scale = 16;

struct plane {
    int width = 0, height = 0;
    std::vector<uint16_t> pixels;

    const uint16_t *row(int y) const {
        return pixels.data() + static_cast<ptrdiff_t>(y) * static_cast<ptrdiff_t>(width);
    }
    /// Interpolated grey level, times `pixel_scale`; needs 0 <= x < width - 1, likewise y.
    double between(double x, double y) const;
    /// Whether `between` is valid at every point within `margin` of (x, y).
    bool holds(double x, double y, double margin) const;
};

/// Level 0 is the image; levels follow while the shorter side is 32 pixels or more.
std::vector<plane> pyramid_of(const image_u8 &image);

/// The levels after `times` binomial filters (1 4 6 4 1, of variance 1) along rows and columns.
std::vector<plane> smoothed(const std::vector<plane> &levels, int times);

/// A position of `level` in level 0's pixels: pixel centres, not corners, have integer coordinates.
inline double level_to_full(double position, int level) {
    const double scale = static_cast<double>(1 << level);
    return (position + 0.5) * scale - 0.5;
}

inline double full_to_level(double position, int level) {
    const double scale = static_cast<double>(1 << level);
    return (position + 0.5) / scale - 0.5;
}

}  // namespace calib::detect

#endif

// SPDX-License-Identifier: Apache-2.0
/// The position of one corner from all pixels near its two edges, by a least-squares fit of a
/// blurred corner to the grey levels.
#ifndef VERGENCE_CALIB_DETECT_DETECT_FIT_HPP
#define VERGENCE_CALIB_DETECT_DETECT_FIT_HPP

#include <optional>

#include "calib/detect/detect_pyramid.hpp"

namespace calib::detect {

/// One of the two edges through a corner: its direction there and its curvature. `curvature_px` is
/// 1/radius, positive when the edge bends clockwise.
struct edge {
    double angle_rad = 0, curvature_px = 0;
};

/// What is known of a corner before the fit. `b` is less than half a turn clockwise from `a`.
struct corner_guess {
    double x = 0, y = 0;
    edge a, b;
    bool light_between = false;  // whether the square between a and b is light
    double blur_px = 1;          // standard deviation, including the extent of a pixel
    double radius_px = 4;        // pixels farther away are ignored
    double band_px = 4;          // pixels farther than this from both edges are ignored
};

struct corner_fit {
    double x = 0, y = 0;
    double sigma_px = 0;  // predicted standard deviation of x and of y
    double blur_px = 0;
    double contrast = 0;  // light minus dark, grey levels
    double misfit = 0;    // what is neither corner nor noise, rms, as a share of half the contrast
};

/// Returns nothing when the fit does not converge near the guess or the image does not look like a
/// corner.
std::optional<corner_fit> fit_corner(const plane &level, const corner_guess &guess);

}  // namespace calib::detect

#endif

// SPDX-License-Identifier: Apache-2.0
/// Stereo rigs for tests of geometry: a plain one, and random ones with focal lengths of
/// 500..27,000 px, vergence to 10 degrees, rolled and tilted cameras, off-centre principal points,
/// moderate distortion.
#ifndef VERGENCE_TESTS_RANDOM_RIG_HPP
#define VERGENCE_TESTS_RANDOM_RIG_HPP

#include <algorithm>
#include <cmath>
#include <random>

#include "core/error.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/geometry.h"

namespace random_rig {

using Random = std::mt19937_64;

inline double uniform(Random &random, double low, double high) {
    return low + (high - low) * std::uniform_real_distribution<double>(0, 1)(random);
}

/// Translation that puts the right camera's centre at `centre_mm` of the left frame.
inline void set_right_centre(calibration *rig, const double centre_mm[3]) {
    double R_right_left[9], t_mm[3];
    geometry_rotation_from_vector(rig->rotation_right_left_rad, R_right_left);
    geometry_rotate(R_right_left, centre_mm, t_mm);
    for (int i = 0; i < 3; i++) {
        rig->translation_right_left_mm[i] = -t_mm[i];
    }
}

/// Two equal cameras without distortion, on the x axis, the right one turned to the left.
inline calibration plain_rig(double vergence_rad = 0, double f_px = 600, double baseline_mm = 100) {
    calibration rig = {};
    for (lens *one : {&rig.left, &rig.right}) {
        one->width_px = 640;
        one->height_px = 480;
        one->fx_px = one->fy_px = f_px;
        one->cx_px = 319.5;
        one->cy_px = 239.5;
    }
    rig.rotation_right_left_rad[1] = vergence_rad;
    const double centre_mm[3] = {baseline_mm, 0, 0};
    set_right_centre(&rig, centre_mm);
    return rig;
}

/// A valid lens whose distortion moves a corner by up to some 10 % of its radius.
inline lens make_lens(Random &random, int width_px, int height_px, double f_px) {
    for (;;) {
        lens made = {};
        made.width_px = width_px;
        made.height_px = height_px;
        made.fx_px = f_px * uniform(random, 0.99, 1.01);
        made.fy_px = f_px * uniform(random, 0.99, 1.01);
        made.cx_px = width_px * uniform(random, 0.45, 0.55);
        made.cy_px = height_px * uniform(random, 0.45, 0.55);
        const double corner2 = (width_px * width_px + height_px * height_px) / (4 * f_px * f_px);
        made.k1 = uniform(random, -0.08, 0.08) / corner2;
        made.k2 = uniform(random, -0.03, 0.03) / (corner2 * corner2);
        made.k3 = uniform(random, -0.01, 0.01) / (corner2 * corner2 * corner2);
        made.p1 = uniform(random, -0.002, 0.002) / std::sqrt(corner2);
        made.p2 = uniform(random, -0.002, 0.002) / std::sqrt(corner2);
        if (lens_validate(&made) == ERROR_OK) {
            return made;
        }
    }
}

/// A rig that sees a working range around where its axes meet.
inline calibration make(Random &random, int width_px = 1024, int height_px = 768) {
    calibration rig = {};
    const double f_px = 500 * std::pow(54.0, uniform(random, 0, 1)) * width_px / 2048;
    rig.left = make_lens(random, width_px, height_px, f_px);
    rig.right = make_lens(random, width_px, height_px, f_px);
    const double view_rad = 0.5 * width_px / f_px;  // half of it
    const double vergence_rad = uniform(random, 0.2, 10) * 3.14159265358979 / 180;
    const double tilt_rad = std::min(0.05, 0.1 * view_rad);
    rig.rotation_right_left_rad[0] = uniform(random, -tilt_rad, tilt_rad);
    rig.rotation_right_left_rad[1] = vergence_rad;
    rig.rotation_right_left_rad[2] = uniform(random, -0.1, 0.1);
    const double baseline_mm = uniform(random, 50, 500);
    const double centre_mm[3] = {baseline_mm * std::cos(0.5 * vergence_rad),
                                 baseline_mm * uniform(random, -0.05, 0.05) * view_rad,
                                 baseline_mm * std::sin(0.5 * vergence_rad)};
    set_right_centre(&rig, centre_mm);
    const double verged_mm = 0.5 * baseline_mm / std::tan(0.5 * vergence_rad);
    const double depth_share = std::min(0.3, 200.0 / f_px / vergence_rad);
    rig.depth_near_mm = verged_mm * (1 - depth_share);
    rig.depth_far_mm = verged_mm / (1 - depth_share);
    return rig;
}

}  // namespace random_rig

#endif

// SPDX-License-Identifier: Apache-2.0
/// Corners of a calibration board as a synthetic rig sees them, with the truth.
#ifndef VERGENCE_TESTS_SYNTHETIC_RIG_VIEWS_HPP
#define VERGENCE_TESTS_SYNTHETIC_RIG_VIEWS_HPP

#include <cstdint>
#include <vector>

#include "calib/solve/solve.hpp"
#include "synthetic/camera.hpp"
#include "synthetic/scene.hpp"

namespace synthetic {

struct RigViewsPlan {
    int cameras = 2;
    int width = 2048, height = 1536;
    int columns = 12, rows = 9, boards = 12;
    double focal_px = 26560, focal_right_ratio = 1.003;
    double aspect = 1;                             // fy / fx
    double baseline_mm = 250, distance_mm = 1800;  // the axes meet at that distance
    double fill = 0.6;                             // width of the board over the field of view
    double depth_range = 0.04;                     // boards are within 1 +- this of the distance
    double tilt_min_rad = 0.15, tilt_max_rad = 0.7;
    double noise_px = 0.1;
    // Displacement by the lens at half of the image's diagonal, px; right lenses get 0.8 of it.
    double k1_px = 12, k2_px = -3, p1_px = 0.5, p2_px = -0.4;
    double centre_px = 15;  // principal points off by up to this
    // Instead of k1 to p2 above: an equidistant lens with these coefficients, or a rational one
    // with all of them; half of them on the right.
    bool equidistant = false;
    double wide[8] = {0, 0, 0, 0, 0, 0, 0, 0};  // k1 k2 p1 p2 k3 k4 k5 k6
    double warp_mm[2] = {0, 0};  // z = a (2x/width)^2 + b (2y/height)^2 from the board's middle
    double twist_mm = 0;         // additional z = c (2x/width) (2y/height)
    double stretch = 0;          // the print's rows are longer by this share, its columns as drawn
    // For every other pair, between the left and the right picture: shift of the board along all
    // its axes; and rotation of the right camera about its vertical axis for the second half of all
    // pairs.
    double moved_mm = 0, displacement_rad = 0;
    double roll_max_rad = 0.4;  // largest rotation of the board about its normal
    double waves_px = 0;        // distortion outside all lens models: sin along both axes
    double ripple_px = 0;       // ripple along the radius: no polynomial of few terms follows it
    bool all_in_view = true;    // false: corners outside an image are simply not seen
};

/// A board of 9 x 6 corners held by hand in front of two webcams, 0.9 m away.
RigViewsPlan handheld_plan();

struct RigViews {
    calib::observations seen;
    Rig rig;
    Vector rotation_rad, translation_mm;  // pose of the right camera
    // T_left_board, the board's frame as in calib/base/board.hpp.
    std::vector<Matrix> R_left_board;
    std::vector<Vector> t_left_board_mm;

    calibration truth() const { return calibration_of(rig, rotation_rad, translation_mm); }
};

/// The same plan and seeds give the same views. `scene_seed` places lenses and boards, `noise_seed`
/// moves the corners. Throws when hardly any board of the plan is in view.
RigViews make_rig_views(const RigViewsPlan &plan, uint64_t scene_seed, uint64_t noise_seed);

/// The number of random draws of a test: VERGENCE_DRAWS from the environment, else `default_value`.
int draws(int default_value);

}  // namespace synthetic

#endif

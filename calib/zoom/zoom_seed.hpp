// SPDX-License-Identifier: Apache-2.0
/// Initial values of the zoom rig: each setting of the zooms is calibrated alone, as a rig with
/// fixed lenses, then the lens functions are drawn through the results.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_SEED_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_SEED_HPP

#include <string>
#include <vector>

#include "calib/solve/solve.hpp"
#include "calib/zoom/zoom_equations.hpp"

namespace calib {

/// One setting of both zooms, calibrated alone.
struct zoom_setting {
    std::array<int, CAMERAS> setting{};
    std::vector<size_t> captures;  // captures of the most frequent board, in the caller's order
    // Each camera separately: between positions of the board they may have been turned to it.
    std::array<solution, CAMERAS> alone;
    std::array<double, CAMERAS> focused_mm{};  // median distance of the boards
};

/// Sorts the captures into settings, places and visits. Returns "" or what is wrong.
std::string make_problem(const zoom_observations &seen, zoom_problem *problem);

/// `progress` receives the number of settings done and may throw.
std::vector<zoom_setting> solve_each(const zoom_observations &seen, const zoom_problem &problem,
                                     int threads, const std::function<void(int, int)> &progress);

/// What is known before, as wide as lenses and mounts of this kind are different.
zoom_prior wide_prior(const zoom_problem &problem, const zoom_layout &layout,
                      const zoom_estimate &start);

/// Scales of the lens functions (`log_focal` of each side) and an estimate. Returns "" or why
/// there is no estimate. Places whose pose is not known stay at z = 0 and their views are cleared.
std::string seed_zoom(const zoom_observations &seen, const std::vector<zoom_setting> &settings,
                      zoom_problem *problem, const zoom_orders &orders, zoom_estimate *estimate);

/// Focal length at infinity from that of a lens focused at `distance_mm`.
double focal_at_infinity(double focal_px, double pixel_mm, double distance_mm);

/// Terms of a Chebyshev series through (u, value), weighted by 1 / sigma, against a weak prior that
/// they are small; robust.
std::vector<double> fit_series(const std::vector<double> &u, const std::vector<double> &value,
                               const std::vector<double> &sigma, int terms);

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// What a rig is expected to measure: how well a pair's depth and lengths are known from the
/// motors' positions alone, and with what pictures add.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_EXPECTED_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_EXPECTED_HPP

#include <array>
#include <string>

#include "calib/zoom/zoom_result.hpp"

namespace calib {

/// Of the matches that are assumed: their number and noise, and the relief of the scene as a share
/// of its distance.
const int EXPECTED_MATCHES = 400;
const double EXPECTED_MATCH_PX = 0.1, EXPECTED_RELIEF = 1.0 / 6;
const double EXPECTED_LENGTH_MM = 100;

/// Standard deviations, common to all points of a pair. 0: it cannot be had.
struct expected_sigmas {
    double depth_mm = 0;   // depth in the middle of the left image
    double length_mm = 0;  // length of EXPECTED_LENGTH_MM across the view
};

struct zoom_expected {
    expected_sigmas read;  // motor positions only
    expected_sigmas own;   // motor positions and the pair's own matches
    // Motor positions, the pair's own matches and those of a pair at another zoom, pans untouched.
    expected_sigmas second;
    expected_sigmas board;  // motor positions, the pair's own matches and the board in view
};

/// At `state`, of a scene at `depth_mm` from the left camera. `second` is the state of the other
/// pair.
zoom_expected expect_zoom(const zoom_calibration &calibration, const zoom_state &state,
                          const zoom_state &second, const board &board, double depth_mm);

/// The median distance of the boards from the instrument's origin.
double board_distance_mm(const zoom_solution &solution);

/// At a share of both zooms' ranges, in the middle of the focus, both pans turned to a point
/// straight ahead at `depth_mm` as far as they were calibrated.
zoom_state zoom_aimed(const zoom_calibration &calibration, double share, double depth_mm);
/// `state` at another share of the zooms' ranges.
zoom_state zoom_again(const zoom_calibration &calibration, const zoom_state &state, double share);

/// At one end of the zooms, at the distance that the boards had.
struct zoom_lengths {
    double distance_mm = 0, focal_px = 0;
    zoom_expected expected;
};
std::array<zoom_lengths, 2> lengths_of_zoom(const zoom_solution &solution, const board &board);

/// "Good: ..." or "Not good: ...".
std::string zoom_verdict(const zoom_solution &solution, const std::array<zoom_lengths, 2> &lengths);

}  // namespace calib

#endif

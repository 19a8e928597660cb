// SPDX-License-Identifier: Apache-2.0
/// Whether pairs of a capture are what they should be.
#ifndef VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_CHECK_HPP
#define VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_CHECK_HPP

#include <string>

#include "tools/host/calibrate/calibrate_views.hpp"
#include "tools/host/capture/capture_plan.hpp"

/// Range of the board's white: beyond it the sensor is not linear, below it corners are noisy.
const double CAPTURE_WHITES_MIN = 0.4, CAPTURE_WHITES_MAX = 0.82;

/// How bright the board's white squares are, as a part of full scale; 0: no square was seen.
double capture_whites(const calib::board &board, const calibrate_image &image,
                      const calib::board_view &view);

/// The part of the sensors that shows the board to either camera. `window_px`: column and row where
/// their frames begin.
struct capture_region {
    int x_px, y_px, width_px, height_px;
};
using capture_windows = std::array<std::array<double, 2>, 2>;
capture_region capture_region_of(const capture_optics &optics, const capture_shot &shot,
                                 const capture_windows &window_px);

/// The corner nearest to the middle of the frame, as it will be when the focal length has grown by
/// `ratio`; the view has one.
struct capture_point {
    double x_px, y_px;
};
capture_point capture_middle_corner(const capture_optics &optics, const calib::board_view &view,
                                    double ratio);

/// A region of the whole sensor for autofocus, "X,Y,WIDTH,HEIGHT", about a corner.
std::string capture_focus_region(const capture_optics &optics, const capture_point &corner,
                                 const std::array<double, 2> &window_px);

/// Whether both cameras see enough corners of the board, and why not, a line for each that does
/// not.
bool capture_is_seen(const capture_shot &shot);
std::string capture_not_seen(const capture_shot &shot);

/// Whether both pictures of a pair show the board in a size that one zoom explains. Returns "", or
/// one sentence.
std::string capture_check_sides(const capture_look look[2]);

/// Whether both pictures changed between two pairs as the focal length did, `ratio` times, and only
/// so. Returns "", or one sentence that says what moved.
std::string capture_check_zoomed(const capture_optics &optics, const capture_shot &before,
                                 const capture_shot &after, double ratio);

/// From the first to the last picture of each position, in minutes.
double capture_minutes(const std::vector<capture_shot> &shots);

#endif

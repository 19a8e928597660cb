// SPDX-License-Identifier: Apache-2.0
/// What the calibration of a zoom rig is computed from: pairs of one board or several, at several
/// positions of lenses, servos and board.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_DATA_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_DATA_HPP

#include <array>
#include <string>
#include <vector>

#include "calib/base/board.hpp"
#include "core/math.h"

namespace calib {

/// Positions of one camera's motors while a pair was taken, as means of readings.
struct zoom_axes {
    double zoom_counts = 0, focus_counts = 0, pan_rad = 0;
};

struct zoom_capture {
    std::array<std::string, 2> name;  // of the images, for reports; should be unique
    size_t board = 0;                 // index in `zoom_observations::boards`
    int position = 0;  // of the board: captures with the same number show it in the same place
    int visit = 0;     // of the pans: between captures with the same number they were not turned
    std::array<zoom_axes, 2> axes;
    std::array<board_view, 2> view;
};

struct zoom_observations {
    std::vector<board> boards;
    std::array<int, 2> width_px{}, height_px{};
    std::array<double, 2> pixel_mm{};
    std::vector<zoom_capture> captures;
    /// Standard deviation of the angle at which a servo comes to rest.
    double pan_sigma_rad = 0.3 * MATH_RAD_PER_DEGREE;
    /// False: the positions of the lenses are exact.
    bool reading_noise = true;
};

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// What the calibration of a zoom rig is computed from: pairs of one board or several, at several
/// positions of lenses, servos and board.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_DATA_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_DATA_HPP

#include <array>
#include <vector>

#include "calib/base/solution.hpp"
#include "core/math.h"

namespace calib {

struct zoom_observations {
    std::vector<board> boards;
    std::array<int, 2> width_px{}, height_px{};
    std::array<double, 2> pixel_mm{};
    std::vector<capture> captures;
    /// Standard deviation of the angle at which a servo comes to rest.
    double pan_sigma_rad = 0.3 * MATH_RAD_PER_DEGREE;
    /// False: the positions of the lenses are exact.
    bool reading_noise = true;
};

}  // namespace calib

#endif

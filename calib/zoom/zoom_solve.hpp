// SPDX-License-Identifier: Apache-2.0
/// From corners at many settings of the zooms to the calibration of the whole rig. The same input
/// gives the same bytes, with any number of threads.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_SOLVE_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_SOLVE_HPP

#include <functional>
#include <string>

#include "calib/zoom/zoom_result.hpp"

namespace calib {

struct zoom_options {
    int threads = 1;
    /// The paper's way, for comparison: each setting alone, f and all else on straight lines.
    bool paper = false;
    /// Whether each setting is also predicted from the others, for the validation block.
    bool leave_out = true;
    /// Receives a progress text for the user. Called often and may throw to end the work early; may
    /// be empty.
    std::function<void(const char *)> progress;
};

/// Never throws because of invalid observations.
zoom_solution solve_zoom(const zoom_observations &seen, const zoom_options &options);

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// Checks a zoom rig on what it was not computed from, and its residuals for patterns.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_CHECK_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_CHECK_HPP

#include <functional>

#include "calib/zoom/zoom_result.hpp"

namespace calib {

/// Solves again without each setting, except those at the ends, and predicts it: fills
/// `held_out_px` and `held_out_focal` of the calibration's validation, and adds to `warnings` if
/// they are too large.
void check_left_out(zoom_solution *solution, int threads, const std::function<void()> &between);

/// Adds to `warnings` what cannot be of a described rig: sides that are exchanged, cameras too far
/// apart or turned too far from each other, a baseline that is not determined, a focal length that
/// does not follow the zoom.
void check_rig(zoom_solution *solution);

/// Fills `chi_square_z` of the validation, and adds to `warnings`.
void check_fit(zoom_solution *solution);

}  // namespace calib

#endif

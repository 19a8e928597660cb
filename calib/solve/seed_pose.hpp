// SPDX-License-Identifier: Apache-2.0
/// The pose of one board when the lenses are known.
#ifndef VERGENCE_CALIB_SOLVE_SEED_POSE_HPP
#define VERGENCE_CALIB_SOLVE_SEED_POSE_HPP

#include "calib/bundle/bundle.hpp"

namespace calib {

/// One position of the board as all cameras saw it.
using both_views = std::array<bundle_view, CAMERAS>;

/// Refines a pose on the used corners of the used views by Levenberg and Marquardt's method.
/// With `loss_scale` > 0 (in standard deviations) a corner counts by Cauchy's loss, whose scale
/// starts at the residuals' own median and comes down to it, so that a rough start converges, too.
/// Returns the cost per corner (mean loss in squared standard deviations), or a negative number,
/// pose untouched, when the board is not in front of the cameras.
double fit_pose(const bundle &data, const both_views &views, const bundle_state &state,
                double loss_scale, rigid *T_left_board);

/// The other pose from which a distant flat board looks nearly the same: its tilt mirrored at the
/// line of sight (Necker's reversal). `camera` is the one whose line of sight counts.
rigid second_pose(const rigid &T_camera_board);

/// `fit_pose` from the given pose and from its second; the better of both. Result as `fit_pose`.
double fit_pose_either_way(const bundle &data, const both_views &views, const bundle_state &state,
                           double loss_scale, rigid *T_left_board);

}  // namespace calib

#endif

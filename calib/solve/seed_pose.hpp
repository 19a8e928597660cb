// SPDX-License-Identifier: Apache-2.0
/// The pose of one board when the lenses are known.
#ifndef VERGENCE_CALIB_SOLVE_SEED_POSE_HPP
#define VERGENCE_CALIB_SOLVE_SEED_POSE_HPP

#include "calib/bundle/bundle.hpp"

namespace calib {

/// One board position as seen by all cameras.
using both_views = std::array<bundle_view, CAMERAS>;

/// Refines a pose on the used corners of the used views by the Levenberg-Marquardt method. With
/// `loss_scale` > 0 (in standard deviations) a corner is weighted by Cauchy's loss, whose scale
/// starts at the residuals' own median and is reduced to it, so that a rough start also converges.
/// Returns the cost per corner (mean loss in squared standard deviations), or a negative number,
/// pose untouched, when the board is not in front of the cameras.
double fit_pose(const bundle &data, const both_views &views, const bundle_state &state,
                double loss_scale, rigid *T_left_board);

/// The other pose from which a distant flat board looks nearly the same: its tilt mirrored at the
/// line of sight (Necker reversal). `camera` is the one whose line of sight is used.
rigid second_pose(const rigid &T_camera_board);

/// Runs `fit_pose` from the given pose and from its second; keeps the better one. Result as
/// `fit_pose`.
double fit_pose_either_way(const bundle &data, const both_views &views, const bundle_state &state,
                           double loss_scale, rigid *T_left_board);

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// Normal equations of a bundle with the position of each board eliminated.
#ifndef VERGENCE_CALIB_BUNDLE_REDUCED_EQUATIONS_HPP
#define VERGENCE_CALIB_BUNDLE_REDUCED_EQUATIONS_HPP

#include <vector>

#include "calib/base/linear.hpp"
#include "calib/bundle/bundle.hpp"

namespace calib {

/// Indices of the parameters that all boards share.
enum {
    LENS_AT = 0,
    RIG_AT = CAMERAS * LENS_PARAMETERS,
    WARP_AT = RIG_AT + POSE_PARAMETERS,
    SHARED = WARP_AT + WARP_PARAMETERS,
};

/// What one board position contributes to the shared parameters.
struct board_equations {
    matrix shared = matrix::Zero(SHARED, SHARED);
    matrix gradient = matrix::Zero(SHARED, 1);
    /// Rotation and shift of the frame that this board position implies: their dependence on the
    /// shared parameters and their own covariance, in squared sigmas.
    matrix frame_by_shared = matrix::Zero(POSE_PARAMETERS, SHARED);
    matrix frame_noise = matrix::Zero(POSE_PARAMETERS, POSE_PARAMETERS);
    double squares = 0;  // sum of squared residuals, each divided by its sigma
    long residuals = 0;
};

/// Of one used board position, at the least-squares solution `state`.
board_equations eliminate_board(const bundle &data, const bundle_state &state, size_t capture);

/// Indices that are estimated.
std::vector<int> free_places(const bundle &data, const bundle_options &options);

/// The rows and columns of `parameters`.
matrix picked(const matrix &shared, const std::vector<int> &parameters);

/// Inverse of a symmetric matrix with its diagonal scaled to 1. Undetermined directions become
/// huge, not infinite, and set `*singular`.
matrix inverse_of(const matrix &A, bool *singular);

}  // namespace calib

#endif

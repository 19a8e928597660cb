// SPDX-License-Identifier: Apache-2.0
/// Tests whether the board positions agree on the lenses and the rig as well as corner noise
/// allows. Something that moved between left and right pictures, a rig that was bumped, focus
/// breathing or a lens outside the model affects a whole view at once. Fits then look good and
/// error bars small, because corner errors are assumed to be independent.
#ifndef VERGENCE_CALIB_BUNDLE_BOARD_SCATTER_HPP
#define VERGENCE_CALIB_BUNDLE_BOARD_SCATTER_HPP

#include <vector>

#include "calib/bundle/reduced_equations.hpp"

namespace calib {

struct board_scatter {
    double ratio =
        1;         // variance of the shared parameters over the variance that corner noise explains
    double z = 0;  // its standard score
    matrix covariance;  // covariance of the shared parameters, from the scatter of the positions
};

/// Leaves out one position after the other (the jackknife, to first order). `boards` are all used
/// positions at the least-squares solution, `parameters` the estimated parameters, `sigma0` the
/// scale of the residuals. With fewer than four positions, or where one position alone determines a
/// parameter, the result is ratio 1, z 0 and the covariance of corner noise. Source: B. Efron, C.
/// Stein, "The jackknife estimate of variance", 1981.
board_scatter scatter_of(const std::vector<board_equations> &boards,
                         const std::vector<int> &parameters, double sigma0);

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// Do the positions of the board agree on the lenses and the rig as well as the noise of their
/// corners lets them? Something that moved between left and right pictures, a rig that was knocked,
/// a focus that breathes or a lens that the model cannot describe are wrong for a whole view at
/// once: fits look well and error bars small, for corners are taken to be wrong one by one.
#ifndef VERGENCE_CALIB_BUNDLE_BOARD_SCATTER_HPP
#define VERGENCE_CALIB_BUNDLE_BOARD_SCATTER_HPP

#include <vector>

#include "calib/bundle/reduced_equations.hpp"

namespace calib {

struct board_scatter {
    double ratio = 1;   // variance of the shared numbers over what corner noise makes of it
    double z = 0;       // its standard score
    matrix covariance;  // of the shared numbers, as the positions scatter
};

/// By leaving out one position after the other (the jackknife, to first order). `boards` are all
/// used positions at the least-squares solution, `places` what is estimated, `sigma0` the
/// residuals' scale. With fewer than four positions, or where one alone determines something,
/// nothing is known: ratio 1, z 0 and the covariance that corner noise makes. Source: B. Efron, C.
/// Stein, "The jackknife estimate of variance", 1981.
board_scatter scatter_of(const std::vector<board_equations> &boards, const std::vector<int> &places,
                         double sigma0);

}  // namespace calib

#endif

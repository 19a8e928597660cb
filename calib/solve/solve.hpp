// SPDX-License-Identifier: Apache-2.0
/// From corners to the calibration of a stereo pair, or of one camera alone. Input: the observed
/// corners. Output: lenses, rig, board positions, every outlier by name, error bars and a verdict.
/// The same input gives the same bytes, with any number of threads and in any order of the input.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_HPP

#include "calib/base/solution.hpp"

namespace calib {

/// Solves. Never throws because of invalid observations: the verdict reports them.
solution solve(const observations &seen, const solve_options &options);

}  // namespace calib

#endif

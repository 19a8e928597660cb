// SPDX-License-Identifier: Apache-2.0
/// Looks for a pattern in the residuals of a solution.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_FIT_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_FIT_HPP

#include "calib/bundle/bundle.hpp"
#include "calib/solve/solve.hpp"

namespace calib {

/// Chi-square tests of the mean residual in each cell of the images and at each corner of the
/// board. Noise leaves no pattern; a lens or a board outside the model does. `sigma0` as in
/// `solution`.
fit_test test_fit(const bundle &data, const bundle_state &state, double sigma0);

}  // namespace calib

#endif

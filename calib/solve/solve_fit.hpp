// SPDX-License-Identifier: Apache-2.0
/// Looks for a pattern in the residuals of a solution.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_FIT_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_FIT_HPP

#include "calib/base/solution.hpp"
#include "calib/bundle/bundle.hpp"

namespace calib {

/// Chi-square tests of the mean residual in each cell of the images and at each corner of the
/// board. Noise leaves no pattern; a lens or a board outside the model does. `sigma0` as in
/// `solution`.
fit_test test_fit(const bundle &data, const bundle_state &state, double sigma0);

/// How far one camera's lens is from its model: what the residuals along the radius have in common
/// on most boards at the same distance from the axis. Something that moved leaves residuals that
/// differ from board to board.
struct lens_test {
    double off_px = 0;  // rms of the common part
    double ratio = 0;   // its variance over that of the boards' own parts (analysis of variance)
};

/// {0, 0} where too few boards share a distance.
lens_test test_lens(const bundle &data, const bundle_state &state, int camera);

}  // namespace calib

#endif

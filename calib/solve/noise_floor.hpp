// SPDX-License-Identifier: Apache-2.0
/// Corner errors beyond the noise of the images.
#ifndef VERGENCE_CALIB_SOLVE_NOISE_FLOOR_HPP
#define VERGENCE_CALIB_SOLVE_NOISE_FLOOR_HPP

#include <vector>

#include "calib/bundle/bundle.hpp"

namespace calib {

/// Standard deviations that the detector predicts cover only the image noise at each corner. An
/// inexact print, compressed images and asymmetric blur also move corners, all by similar amounts.
/// If corners were weighted by image noise alone, the sharpest views would dominate and the error
/// bars of all others would be wrong.
class noise_floor {
  public:
    explicit noise_floor(const bundle &data);

    /// Estimates the missing variance robustly from the residuals of the used corners and adds it
    /// to the variance of every corner of `data`. 0 when the corners' own noise explains the
    /// residuals within 30 %. `freedom_share` is the part of the residuals that the fit did not
    /// absorb.
    void update(const bundle_state &state, double freedom_share, bundle *data);

    double px() const { return floor_px_; }

    /// Residuals over the corners' predicted noise: 1 when the noise explains them.
    double ratio() const { return ratio_; }

  private:
    std::vector<double> given_px_;  // given sigmas of all corners, in the order of the bundle
    double floor_px_ = 0, ratio_ = 1;
};

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// What corners are off by beyond the noise of their images.
#ifndef VERGENCE_CALIB_SOLVE_NOISE_FLOOR_HPP
#define VERGENCE_CALIB_SOLVE_NOISE_FLOOR_HPP

#include <vector>

#include "calib/bundle/bundle.hpp"

namespace calib {

/// Standard deviations that corners came with, which know the noise of the image at each corner. A
/// print that is not exact, compressed images and blur that is not round move corners as well, all
/// of them alike: were they weighted by their own noise alone, the sharpest views would rule and
/// the error bars of all others be wrong.
class noise_floor {
  public:
    explicit noise_floor(const bundle &data);

    /// Estimates what is missing, robustly, from the residuals of the used corners, and adds it to
    /// the variance of every corner of `data`. 0 when the corners' own noise explains them within
    /// 30 %. `spare_share` is the part of the residuals that the fit did not take.
    void update(const bundle_state &state, double spare_share, bundle *data);

    double px() const { return floor_px_; }

    /// Residuals over what the corners' own noise makes: 1 when that explains them.
    double ratio() const { return ratio_; }

  private:
    std::vector<double> given_px_;  // of all corners, in the order of the bundle
    double floor_px_ = 0, ratio_ = 1;
};

}  // namespace calib

#endif

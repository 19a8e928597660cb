// SPDX-License-Identifier: Apache-2.0
/// Approximates a lens for programs whose model has no k3.
#ifndef VERGENCE_CALIB_BASE_LENS_REFIT_HPP
#define VERGENCE_CALIB_BASE_LENS_REFIT_HPP

#include "stereo/geometry/lens.h"

namespace calib {

struct lens_refit {
    lens fitted;            // its k3 is 0; may be a lens that `lens_validate` rejects
    double rms_px, max_px;  // error over the image
};

/// The lens whose k1 k2 p1 p2 map the rays of the image closest to where `exact`, which must be
/// valid, maps them, by least squares; the other parameters are unchanged.
lens_refit refit_without_k3(const lens &exact);

}  // namespace calib

#endif

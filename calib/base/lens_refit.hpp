// SPDX-License-Identifier: Apache-2.0
/// A lens for programs whose model has no k3.
#ifndef VERGENCE_CALIB_BASE_LENS_REFIT_HPP
#define VERGENCE_CALIB_BASE_LENS_REFIT_HPP

#include "stereo/geometry/lens.h"

namespace calib {

struct lens_refit {
    lens fitted;            // without k3; may be one that `lens_validate` refuses
    double rms_px, max_px;  // how far off it is, over the image
};

/// The lens whose k1 k2 p1 p2 put the rays of the image nearest to where `exact`, which must be
/// valid, sees them, by least squares; the rest is as it was.
lens_refit refit_without_k3(const lens &exact);

}  // namespace calib

#endif

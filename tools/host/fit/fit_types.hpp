// SPDX-License-Identifier: Apache-2.0
/// The types of fit.hpp.
#ifndef VERGENCE_TOOLS_HOST_FIT_FIT_TYPES_HPP
#define VERGENCE_TOOLS_HOST_FIT_FIT_TYPES_HPP

const int fit_block_px = 16;

/// A measured point in the left camera's frame.
struct fit_point {
    double position_mm[3];
    double sigma_mm;   // along its ray; 0: not predicted
    double normal[3];  // 0 0 0: not known (only cylinders use it)
    int x_px, y_px;    // pixel of the rectified left image
};

/// Standard deviation that all depths share, at one depth. sigma_mm < 0: not known.
struct fit_common {
    double sigma_mm, depth_mm;
};

struct fit_value {
    double value, sigma;  // `sigma`: both parts
    double sigma_common;  // of which all points share this; < 0: not known, and not in `sigma`
};

#endif

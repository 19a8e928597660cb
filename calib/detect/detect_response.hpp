// SPDX-License-Identifier: Apache-2.0
/// The per-pixel part of the search for saddle points.
#ifndef VERGENCE_CALIB_DETECT_DETECT_RESPONSE_HPP
#define VERGENCE_CALIB_DETECT_DETECT_RESPONSE_HPP

#include <vector>

#include "calib/detect/detect_pyramid.hpp"

namespace calib::detect {

struct peak {
    double x = 0, y = 0;  // position of the saddle point, subpixel
    float response = 0;   // minus the determinant of the second derivatives
};

/// The local maxima (in 5x5 pixels) of the saddle response of the smoothed level, in reading order.
std::vector<peak> saddle_peaks(const plane &level);

}  // namespace calib::detect

#endif

// SPDX-License-Identifier: Apache-2.0
/// The iris for a range of depths: as far closed as it and lamps on the mains need, and no further
/// than diffraction, the iris itself or the light allow.
#ifndef VERGENCE_FOCUS_DEPTH_IRIS_H
#define VERGENCE_FOCUS_DEPTH_IRIS_H

#include "focus/lens_optics.h"

#ifdef __cplusplus
extern "C" {
#endif

enum depth_iris_limit {
    DEPTH_IRIS_NEEDED,       ///< closed as far as needed
    DEPTH_IRIS_STEADY,       ///< closed further than needed, so that lamps do not flicker
    DEPTH_IRIS_OPEN,         ///< sharp with the iris open
    DEPTH_IRIS_DIFFRACTION,  ///< further closed, diffraction would blur as much as the worse end
    DEPTH_IRIS_CLOSED,       ///< closes no further
    DEPTH_IRIS_DARK,         ///< further closed it would be too dark
};

/// f-numbers; 0 < open <= closed.
struct depth_iris_limits {
    double open, closed;
    double dark;    ///< from which on it is too dark; INFINITY: not known
    double steady;  ///< from which on exposures are so long that lamps do not flicker; 0: any
};

struct depth_iris {
    double f_number;
    enum depth_iris_limit limit;
    double blur_mm;                      ///< of the worse end, on the sensor, without diffraction
    double sharp_near_mm, sharp_far_mm;  ///< between which the blur is at most that asked for
};

/// The iris at the focal length and focus distance of `lens` (its f-number does not count) for a
/// blur of at most `blur_mm` > 0 from near to far, 0 < near <= far <= INFINITY.
struct depth_iris depth_iris_for(const struct lens_state *lens, double near_mm, double far_mm,
                                 double blur_mm, const struct depth_iris_limits *limits);

#ifdef __cplusplus
}
#endif

#endif

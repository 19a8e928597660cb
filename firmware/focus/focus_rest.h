// SPDX-License-Identifier: Apache-2.0
/// Where a peak is, from its curve and from what was seen at rest near it.
#ifndef VERGENCE_FOCUS_FOCUS_REST_H
#define VERGENCE_FOCUS_FOCUS_REST_H

#include "focus/focus_curve.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What one rest of the ring showed, each with its standard deviation.
struct focus_rest {
    double position, position_deviation;    ///< counts
    double sharpness, sharpness_deviation;  ///< the latter > 0
};

/// The place of a peak in counts.
struct focus_place {
    double position;  ///< mean
    double distance;  ///< mean distance of the last rest from it
};

/// Bayes' mean of the peak's place, over places, widths and heights around those of the fitted
/// `peak`: the curve of focus_peak_at, read at `count` > 0 rests.
struct focus_place focus_rest_place(const struct focus_peak *peak, const struct focus_rest *rests,
                                    unsigned count);

#ifdef __cplusplus
}
#endif

#endif

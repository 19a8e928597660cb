// SPDX-License-Identifier: Apache-2.0
/// Where a peak is, from its curve and from what was seen at rest near it.
#ifndef VERGENCE_FOCUS_FOCUS_STOP_H
#define VERGENCE_FOCUS_FOCUS_STOP_H

#include "focus/focus_curve.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What one stop of the ring showed, each with its standard deviation.
struct focus_stop_sample {
    double position, position_deviation;    ///< counts
    double sharpness, sharpness_deviation;  ///< the latter > 0
};

/// The place of a peak in counts.
struct focus_peak_estimate {
    double position;  ///< mean
    double distance;  ///< mean distance of the last stop from it
};

/// Bayes' mean of the peak's place, over places, widths and heights around those of the fitted
/// `peak`: the curve of focus_peak_at, read at `count` > 0 stops.
struct focus_peak_estimate focus_stop_estimate(const struct focus_peak *peak,
                                               const struct focus_stop_sample *stops,
                                               unsigned count);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// Uncertainty of anything that is computed from the pair at a state: from the covariance of the
/// parameters, the irregularities, the motors and the scale, by derivatives. The unknowns that a
/// calibration leaves are listed with their standard deviations, for those who estimate them.
#ifndef VERGENCE_STEREO_ZOOM_ZOOM_SIGMA_H
#define VERGENCE_STEREO_ZOOM_ZOOM_SIGMA_H

#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { ZOOM_VALUES_MAX = 32 };

/// Computes `count` values of a pair; `context` is the caller's.
typedef void zoom_evaluate(const struct zoom_pair *pair, void *context, double *values);

/// Variances of a value by their sources.
struct zoom_variance {
    double lens;   // functions of the lens: their parameters and irregularities
    double mount;  // pan axis and mount
    double motor;  // readings and drift of zoom and focus
    double pan;    // angle at which the servo rests
    double cross;  // covariance between lens and mount parameters, times 2; may be negative
};

double zoom_variance_sum(const struct zoom_variance *variance);

/// Variances of `count` <= ZOOM_VALUES_MAX values at a state. Scale, which no ratio of lengths
/// shows, is not included.
void zoom_propagate(const struct zoom_calibration *calibration, const struct zoom_state *state,
                    zoom_evaluate *evaluate, void *context, int count,
                    struct zoom_variance *variance);

/// Variances of the depth of a point that the left camera sees at a pixel, at `depth_mm` in its
/// frame, with scale. Matching is not included. All 0 if the right camera does not see the point.
struct zoom_variance zoom_depth_variance(const struct zoom_calibration *calibration,
                                         const struct zoom_state *state, const double pixel_px[2],
                                         double depth_mm);

/// The two sigmas of `struct calibration` that describe the uncertainty of depth at a state best,
/// over the middle of the image and depths around where the axes meet.
void zoom_depth_sigma(const struct zoom_calibration *calibration, const struct zoom_state *state,
                      double *scale_sigma, double *yaw_sigma_rad);

#ifdef __cplusplus
}
#endif

#endif

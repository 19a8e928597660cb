// SPDX-License-Identifier: Apache-2.0
/// Figures of a result that are worth more than one reader's time.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FIGURES_H
#define VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FIGURES_H

#include <stdbool.h>

#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Smallest box around the points in mm, left camera frame. Needs at least one point.
struct result_figures_box {
    double least_mm[3], greatest_mm[3];
};
struct result_figures_box result_figures_bounds(const struct reconstruct_result *result);

/// Pixels of the rectified left image that have a disparity, in percent of all.
double result_figures_density_percent(const struct reconstruct_result *result);

enum { RESULT_FIGURES_QUANTILES = 3 };

/// Quantiles of depth and sigma: single points at the ends of the range say little about the rest.
struct result_figures_quantiles {
    double depth_mm[RESULT_FIGURES_QUANTILES];  // of 1 %, 50 % and 99 % of the points
    double sigma_mm[RESULT_FIGURES_QUANTILES];  // of 5 %, 50 % and 95 %
};

/// Needs at least one point. Returns false (spread untouched) when memory runs out.
bool result_figures_spread(const struct reconstruct_result *result,
                           struct result_figures_quantiles *spread);

/// Why the rows of the rectified images do not correspond as a calibration that fits leaves them:
/// by the median, or by a trend over the image, whose 95th percentile shows what the median hides.
/// NULL: they do, or were not measured. Static storage.
const char *result_figures_rows_fault(const struct triangulate_vertical *vertical,
                                      const struct rectify_plan *plan, double scale);

#ifdef __cplusplus
}
#endif

#endif

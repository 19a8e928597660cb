// SPDX-License-Identifier: Apache-2.0
/// Figures of a result that several writers use.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FIGURES_H
#define VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FIGURES_H

#include <stdbool.h>

#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether the point of this pixel (y * width + x) was not measured: see stereo/fill.h.
bool result_figures_is_filled(const struct reconstruct_result *result, uint32_t pixel);

/// Number of points without the filled ones.
uint32_t result_figures_measured_count(const struct reconstruct_result *result);

/// Smallest box around the measured points in mm, left camera frame. Needs at least one point.
struct result_figures_box {
    double min_mm[3], greatest_mm[3];
};
struct result_figures_box result_figures_bounds(const struct reconstruct_result *result);

/// Pixels of the rectified left image that were measured, in percent of all.
double result_figures_density_percent(const struct reconstruct_result *result);

enum { RESULT_FIGURES_QUANTILES = 3 };

/// Quantiles of depth and sigma of the measured points; extreme values would be dominated by single
/// points.
struct result_figures_quantiles {
    double depth_mm[RESULT_FIGURES_QUANTILES];  // quantiles for 1 %, 50 % and 99 % of the points
    double sigma_mm[RESULT_FIGURES_QUANTILES];  // quantiles for 5 %, 50 % and 95 % of the points
};

/// Needs at least one point. False if out of memory (`spread` is unchanged).
bool result_figures_spread(const struct reconstruct_result *result,
                           struct result_figures_quantiles *spread);

/// The same of the measured points with depths from near_um to far_um, inclusive, of which there
/// are `points`, at least one.
bool result_figures_spread_within(const struct reconstruct_result *result, int32_t near_um,
                                  int32_t far_um, uint32_t points,
                                  struct result_figures_quantiles *spread);

/// Why the rows of the rectified images do not correspond as they do with a matching calibration:
/// by the median, or by a trend over the image, whose 95th percentile shows what the median hides.
/// NULL: they correspond, or were not measured. Static storage.
const char *result_figures_rows_fault(const struct triangulate_vertical *vertical,
                                      const struct rectify_plan *plan, double scale);

#ifdef __cplusplus
}
#endif

#endif

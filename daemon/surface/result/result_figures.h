// SPDX-License-Identifier: Apache-2.0
/// Figures of a result that several writers use.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FIGURES_H
#define VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FIGURES_H

#include <stdbool.h>

#include "surface/surface_figures.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Smallest box around the measured points in mm, left camera frame. Needs at least one point.
struct result_figures_box {
    double min_mm[3], greatest_mm[3];
};
struct result_figures_box result_figures_bounds(const struct reconstruct_result *result);

/// Pixels of the rectified left image that were measured, in percent of all.
double result_figures_density_percent(const struct reconstruct_result *result);

/// The spread of all measured points, of which there is at least one. False if out of memory
/// (`spread` is unchanged).
bool result_figures_spread(const struct reconstruct_result *result,
                           struct surface_figures_spread *spread);

/// Why the rows of the rectified images do not correspond as they do with a matching calibration:
/// by the median, or by a trend over the image, whose 95th percentile shows what the median hides.
/// NULL: they correspond, or were not measured. Static storage.
const char *result_figures_rows_fault(const struct triangulate_vertical *vertical,
                                      const struct rectify_plan *plan, double scale);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/result_figures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/invariant.h"

enum { DIGIT_BITS = 16, DIGIT_VALUES = 1 << DIGIT_BITS };

struct result_figures_box result_figures_bounds(const struct reconstruct_result *result) {
    INVARIANT(result->vertex_count > 0);
    struct result_figures_box bounds;
    for (uint32_t i = 0; i < result->vertex_count; i++) {
        const struct triangulate_point *point = &result->points[i];
        const int32_t um[3] = {point->x_um, point->y_um, point->z_um};
        for (int axis = 0; axis < 3; axis++) {
            const double mm = um[axis] / 1000.0;
            if (i == 0 || mm < bounds.min_mm[axis]) {
                bounds.min_mm[axis] = mm;
            }
            if (i == 0 || mm > bounds.greatest_mm[axis]) {
                bounds.greatest_mm[axis] = mm;
            }
        }
    }
    return bounds;
}

double result_figures_density_percent(const struct reconstruct_result *result) {
    const double pixels = (double)result->plan.width_px * result->plan.height_px;
    return 100.0 * result->reason_count[REASON_VALID] / pixels;
}

typedef uint32_t point_value(const struct triangulate_point *point);

static uint32_t depth_of(const struct triangulate_point *point) {
    return point->z_um > 0 ? (uint32_t)point->z_um : 0;
}

static uint32_t sigma_of(const struct triangulate_point *point) {
    return point->sigma_um;
}

/// First value whose cumulative count exceeds `*rank`, which becomes the rank within that value.
static uint32_t find_rank(const uint32_t *counts, uint32_t *rank) {
    uint32_t value = 0;
    while (*rank >= counts[value]) {
        *rank -= counts[value];
        value++;
        INVARIANT(value < DIGIT_VALUES);
    }
    return value;
}

/// The value that `percent` of the points do not exceed: first by a histogram of the upper half of
/// its bits, then of the lower half among the points that share the upper.
static double quantile_mm(const struct reconstruct_result *result, point_value *value_of,
                          int percent, uint32_t *counts) {
    uint32_t rank = (uint32_t)((uint64_t)(result->vertex_count - 1) * (uint32_t)percent / 100);
    memset(counts, 0, DIGIT_VALUES * sizeof *counts);
    for (uint32_t i = 0; i < result->vertex_count; i++) {
        counts[value_of(&result->points[i]) >> DIGIT_BITS]++;
    }
    const uint32_t upper = find_rank(counts, &rank);
    memset(counts, 0, DIGIT_VALUES * sizeof *counts);
    for (uint32_t i = 0; i < result->vertex_count; i++) {
        const uint32_t value = value_of(&result->points[i]);
        if (value >> DIGIT_BITS == upper) {
            counts[value & (DIGIT_VALUES - 1)]++;
        }
    }
    return (upper << DIGIT_BITS | find_rank(counts, &rank)) / 1000.0;
}

bool result_figures_spread(const struct reconstruct_result *result,
                           struct result_figures_quantiles *spread) {
    static const int depth_percent[RESULT_FIGURES_QUANTILES] = {1, 50, 99};
    static const int sigma_percent[RESULT_FIGURES_QUANTILES] = {5, 50, 95};
    INVARIANT(result->vertex_count > 0);
    uint32_t *counts = malloc(DIGIT_VALUES * sizeof *counts);
    if (counts == NULL) {
        return false;
    }
    for (int i = 0; i < RESULT_FIGURES_QUANTILES; i++) {
        spread->depth_mm[i] = quantile_mm(result, depth_of, depth_percent[i], counts);
        spread->sigma_mm[i] = quantile_mm(result, sigma_of, sigma_percent[i], counts);
    }
    free(counts);
    return true;
}

const char *result_figures_rows_fault(const struct triangulate_vertical *vertical,
                                      const struct rectify_plan *plan, double scale) {
    // In pixels of the raw images, as enlarging them scales the misfit. 30 pairs with matching
    // calibrations stay below 0.24, 0.39 and 0.24 px; a focal length that is off by 0.3 % gives
    // trends of 0.48 px and more at VGA, lenses with k1 = -0.28 treated as undistorted curvatures
    // of 0.73 px and more. Weak distortion left out (k1 = -0.05) stays below: rows hardly show it.
    static const double median_max_px = 0.5, trend_max_px = 0.45, curve_max_px = 0.4;
    const double enlarged = scale > 1 ? scale : 1;
    const double trend_px = vertical->trend_px / enlarged, curve_px = vertical->curve_px / enlarged;
    if (vertical->samples == 0 || (vertical->median_px <= median_max_px * enlarged &&
                                   trend_px <= trend_max_px && curve_px <= curve_max_px)) {
        return NULL;
    }
    const double spread_px = 0.5 * fabs(vertical->slope_y) * plan->height_px;
    const double turn_px = 0.5 * fabs(vertical->slope_x) * plan->width_px;
    const double offset_px = fabs(vertical->offset_px);
    if (curve_px > curve_max_px && vertical->curve_px > vertical->trend_px) {
        return "they are curved relative to each other, as by a different lens distortion";
    }
    if (spread_px > offset_px && spread_px > turn_px) {
        return "they spread from top to bottom, as by a different focal length: check zoom and "
               "focus of both cameras";
    }
    return turn_px > offset_px ? "they are rotated relative to each other: check whether a camera "
                                 "has rolled about its axis"
                               : "they are offset vertically: check whether a camera has tilted";
}

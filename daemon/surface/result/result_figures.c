// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/result_figures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/invariant.h"
#include "stereo/surface.h"

enum {
    DIGIT_BITS = 16,
    DIGIT_VALUES = 1 << DIGIT_BITS,
    HISTOGRAMS = 1 + RESULT_FIGURES_QUANTILES,
};

static void extend(void *cookie, const struct surface_part *part) {
    struct result_figures_box *bounds = cookie;
    for (uint32_t i = 0; i < part->vertex_count; i++) {
        const struct triangulate_point *point = &part->points[i];
        const int32_t um[3] = {point->x_um, point->y_um, point->z_um};
        for (int axis = 0; axis < 3; axis++) {
            const double mm = um[axis] / 1000.0;
            bounds->min_mm[axis] = mm < bounds->min_mm[axis] ? mm : bounds->min_mm[axis];
            bounds->greatest_mm[axis] =
                mm > bounds->greatest_mm[axis] ? mm : bounds->greatest_mm[axis];
        }
    }
}

struct result_figures_box result_figures_bounds(const struct reconstruct_result *result) {
    INVARIANT(result->vertex_count > 0);
    struct result_figures_box bounds = {{INFINITY, INFINITY, INFINITY},
                                        {-INFINITY, -INFINITY, -INFINITY}};
    surface_walk(result, SURFACE_POINTS, extend, &bounds);
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

/// Histograms of one value of all points: of the upper half of its bits, then, for each quantile,
/// of the lower half among the points that share the upper.
struct histograms {
    point_value *value_of;
    const int *percent;
    uint32_t *upper_counts;
    uint32_t *lower_counts[RESULT_FIGURES_QUANTILES];
    uint32_t upper[RESULT_FIGURES_QUANTILES];
    uint32_t rank[RESULT_FIGURES_QUANTILES];
};

enum { DEPTH, SIGMA, VALUES };

static void count_upper(void *cookie, const struct surface_part *part) {
    const struct histograms *of = cookie;
    for (uint32_t i = 0; i < part->vertex_count; i++) {
        for (int value = 0; value < VALUES; value++) {
            of[value].upper_counts[of[value].value_of(&part->points[i]) >> DIGIT_BITS]++;
        }
    }
}

static void count_lower(void *cookie, const struct surface_part *part) {
    const struct histograms *of = cookie;
    for (uint32_t i = 0; i < VALUES * part->vertex_count; i++) {
        const struct histograms *self = &of[i % VALUES];
        const uint32_t value = self->value_of(&part->points[i / VALUES]);
        for (int k = 0; k < RESULT_FIGURES_QUANTILES; k++) {
            self->lower_counts[k][value & (DIGIT_VALUES - 1)] +=
                value >> DIGIT_BITS == self->upper[k];
        }
    }
}

static void find_upper(struct histograms *self, uint32_t points) {
    for (int k = 0; k < RESULT_FIGURES_QUANTILES; k++) {
        self->rank[k] = (uint32_t)((uint64_t)(points - 1) * (uint32_t)self->percent[k] / 100);
        self->upper[k] = find_rank(self->upper_counts, &self->rank[k]);
    }
}

/// The values that `percent` of the points do not exceed.
static void find_quantiles(struct histograms *self, double *mm) {
    for (int k = 0; k < RESULT_FIGURES_QUANTILES; k++) {
        const uint32_t lower = find_rank(self->lower_counts[k], &self->rank[k]);
        mm[k] = (self->upper[k] << DIGIT_BITS | lower) / 1000.0;
    }
}

bool result_figures_spread(const struct reconstruct_result *result,
                           struct result_figures_quantiles *spread) {
    static const int depth_percent[RESULT_FIGURES_QUANTILES] = {1, 50, 99};
    static const int sigma_percent[RESULT_FIGURES_QUANTILES] = {5, 50, 95};
    INVARIANT(result->vertex_count > 0);
    struct histograms of[VALUES] = {[DEPTH] = {.value_of = depth_of, .percent = depth_percent},
                                    [SIGMA] = {.value_of = sigma_of, .percent = sigma_percent}};
    uint32_t *counts = calloc(VALUES * HISTOGRAMS, DIGIT_VALUES * sizeof *counts);
    if (counts == NULL) {
        return false;
    }
    for (size_t value = 0; value < VALUES; value++) {
        of[value].upper_counts = counts + value * HISTOGRAMS * DIGIT_VALUES;
        for (size_t k = 0; k < RESULT_FIGURES_QUANTILES; k++) {
            of[value].lower_counts[k] = of[value].upper_counts + (k + 1) * DIGIT_VALUES;
        }
    }
    surface_walk(result, SURFACE_POINTS, count_upper, of);
    find_upper(&of[DEPTH], result->vertex_count);
    find_upper(&of[SIGMA], result->vertex_count);
    surface_walk(result, SURFACE_POINTS, count_lower, of);
    find_quantiles(&of[DEPTH], spread->depth_mm);
    find_quantiles(&of[SIGMA], spread->sigma_mm);
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

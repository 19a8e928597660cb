// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/result_figures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/invariant.h"
#include "stereo/surface.h"

enum {
    DIGIT_BITS = 11,
    DIGIT_VALUES = 1 << DIGIT_BITS,
    FIRST_SHIFT = 2 * DIGIT_BITS,  // three digits are all bits of a value
};

bool result_figures_is_filled(const struct reconstruct_result *result, uint32_t pixel) {
    const uint32_t width = (uint32_t)result->plan.width_px;
    INVARIANT(pixel < width * (uint32_t)result->plan.height_px);
    return image_u8_row(&result->match.reason, (int)(pixel / width))[pixel % width] ==
           REASON_FILLED;
}

uint32_t result_figures_measured_count(const struct reconstruct_result *result) {
    INVARIANT(result->vertex_count >= result->reason_count[REASON_FILLED]);
    return result->vertex_count - result->reason_count[REASON_FILLED];
}

struct bounds {
    const struct reconstruct_result *result;
    struct result_figures_box box;
};

static void extend(void *cookie, const struct surface_part *part) {
    struct bounds *self = cookie;
    struct result_figures_box *bounds = &self->box;
    for (uint32_t i = 0; i < part->vertex_count; i++) {
        if (result_figures_is_filled(self->result, part->vertex_pixel[i])) {
            continue;
        }
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
    INVARIANT(result_figures_measured_count(result) > 0);
    struct bounds bounds = {
        .result = result,
        .box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}},
    };
    surface_walk(result, SURFACE_POINTS, extend, &bounds);
    return bounds.box;
}

double result_figures_density_percent(const struct reconstruct_result *result) {
    const double pixels = (double)result->plan.width_px * result->plan.height_px;
    return 100.0 * (result->reason_count[REASON_VALID] + result->reason_count[REASON_BEYOND]) /
           pixels;
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

/// Quantiles of one value of all points, digit by digit from the highest.
struct quantiles {
    point_value *value_of;
    uint32_t found[RESULT_FIGURES_QUANTILES];  ///< the digits so far
    uint32_t rank[RESULT_FIGURES_QUANTILES];   ///< ranks among the points that share these digits
    /// Histograms of the next digit of these points.
    uint32_t counts[RESULT_FIGURES_QUANTILES][DIGIT_VALUES];
};

enum { DEPTH, SIGMA, VALUES };

struct spread {
    const struct reconstruct_result *result;
    int32_t near_um, far_um;  ///< of the points that count
    struct quantiles quantiles[VALUES];
    int shift;  ///< position of the digit to be counted, in bits
};

static void count_digits(void *cookie, const struct surface_part *part) {
    struct spread *self = cookie;
    for (uint32_t i = 0; i < VALUES * part->vertex_count; i++) {
        const int32_t z_um = part->points[i / VALUES].z_um;
        if (z_um < self->near_um || z_um > self->far_um ||
            result_figures_is_filled(self->result, part->vertex_pixel[i / VALUES])) {
            continue;
        }
        struct quantiles *quantiles = &self->quantiles[i % VALUES];
        const uint32_t digits = quantiles->value_of(&part->points[i / VALUES]) >> self->shift;
        for (int k = 0; k < RESULT_FIGURES_QUANTILES; k++) {
            quantiles->counts[k][digits % DIGIT_VALUES] +=
                digits >> DIGIT_BITS == quantiles->found[k];
        }
    }
}

static void find_digits(struct quantiles *self) {
    for (int k = 0; k < RESULT_FIGURES_QUANTILES; k++) {
        const uint32_t digit = find_rank(self->counts[k], &self->rank[k]);
        self->found[k] = self->found[k] << DIGIT_BITS | digit;
    }
    memset(self->counts, 0, sizeof self->counts);
}

/// Looks for the values that `percent` of the points do not exceed.
static void start(struct quantiles *self, point_value *value_of, const int *percent,
                  uint32_t points) {
    self->value_of = value_of;
    for (int k = 0; k < RESULT_FIGURES_QUANTILES; k++) {
        self->rank[k] = (uint32_t)((uint64_t)(points - 1) * (uint32_t)percent[k] / 100);
    }
}

bool result_figures_spread(const struct reconstruct_result *result,
                           struct result_figures_quantiles *spread) {
    return result_figures_spread_within(result, INT32_MIN, INT32_MAX,
                                        result_figures_measured_count(result), spread);
}

bool result_figures_spread_within(const struct reconstruct_result *result, int32_t near_um,
                                  int32_t far_um, uint32_t points,
                                  struct result_figures_quantiles *spread) {
    static const int depth_percent[RESULT_FIGURES_QUANTILES] = {1, 50, 99};
    static const int sigma_percent[RESULT_FIGURES_QUANTILES] = {5, 50, 95};
    INVARIANT(points > 0);
    struct spread *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return false;
    }
    self->result = result;
    self->near_um = near_um;
    self->far_um = far_um;
    start(&self->quantiles[DEPTH], depth_of, depth_percent, points);
    start(&self->quantiles[SIGMA], sigma_of, sigma_percent, points);
    for (self->shift = FIRST_SHIFT; self->shift >= 0; self->shift -= DIGIT_BITS) {
        surface_walk(result, SURFACE_POINTS, count_digits, self);
        find_digits(&self->quantiles[DEPTH]);
        find_digits(&self->quantiles[SIGMA]);
    }
    for (int k = 0; k < RESULT_FIGURES_QUANTILES; k++) {
        spread->depth_mm[k] = self->quantiles[DEPTH].found[k] / 1000.0;
        spread->sigma_mm[k] = self->quantiles[SIGMA].found[k] / 1000.0;
    }
    free(self);
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

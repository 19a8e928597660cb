// SPDX-License-Identifier: Apache-2.0
#include "daemon/result_figures.h"

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
            if (i == 0 || mm < bounds.least_mm[axis]) {
                bounds.least_mm[axis] = mm;
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

/// First value whose running count exceeds `*rank`, which becomes the rank within that value.
static uint32_t find_rank(const uint32_t *counts, uint32_t *rank) {
    uint32_t value = 0;
    while (*rank >= counts[value]) {
        *rank -= counts[value];
        value++;
        INVARIANT(value < DIGIT_VALUES);
    }
    return value;
}

/// The value that `percent` of the points do not exceed: counted by the upper half of its bits
/// first, then among the points that share that half by the lower.
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

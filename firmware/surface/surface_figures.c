// SPDX-License-Identifier: Apache-2.0
#include "surface/surface_figures.h"

#include <string.h>

#include "core/invariant.h"
#include "stereo/surface.h"

enum {
    DIGIT_BITS = 11,
    DIGIT_VALUES = 1 << DIGIT_BITS,
    FIRST_SHIFT = 2 * DIGIT_BITS,  // three digits are all bits of a value
};

bool surface_figures_is_filled(const struct reconstruct_result *result, uint32_t pixel) {
    const uint32_t width = (uint32_t)result->plan.width_px;
    INVARIANT(pixel < width * (uint32_t)result->plan.height_px);
    return image_u8_row(&result->match.reason, (int)(pixel / width))[pixel % width] ==
           REASON_FILLED;
}

uint32_t surface_figures_measured_count(const struct reconstruct_result *result) {
    INVARIANT(result->vertex_count >= result->reason_count[REASON_FILLED]);
    return result->vertex_count - result->reason_count[REASON_FILLED];
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
    uint32_t found[SURFACE_FIGURES_QUANTILES];  ///< the digits so far
    uint32_t rank[SURFACE_FIGURES_QUANTILES];   ///< ranks among the points that share these digits
    /// Histograms of the next digit of these points.
    uint32_t counts[SURFACE_FIGURES_QUANTILES][DIGIT_VALUES];
};

enum { DEPTH, SIGMA, VALUES };

struct values {
    uint32_t value[VALUES];
};

struct spread {
    const struct reconstruct_result *result;
    struct surface_figures_depths depths;  ///< of the points that count
    struct quantiles quantiles[VALUES];
    int shift;            ///< position of the digit to be counted, in bits
    struct values *kept;  ///< of these points, after the first walk; NULL: not kept
    uint32_t kept_count, kept_room;
};

static void count_digits(struct spread *self, const struct values *values) {
    for (int i = 0; i < VALUES; i++) {
        struct quantiles *quantiles = &self->quantiles[i];
        const uint32_t digits = values->value[i] >> self->shift;
        for (int k = 0; k < SURFACE_FIGURES_QUANTILES; k++) {
            quantiles->counts[k][digits % DIGIT_VALUES] +=
                digits >> DIGIT_BITS == quantiles->found[k];
        }
    }
}

static void count_part(void *cookie, const struct surface_part *part) {
    struct spread *self = cookie;
    const bool has_filled = self->result->reason_count[REASON_FILLED] > 0;
    for (uint32_t i = 0; i < part->vertex_count; i++) {
        const struct triangulate_point *point = &part->points[i];
        if (point->z_um < self->depths.near_um || point->z_um > self->depths.far_um ||
            (has_filled && surface_figures_is_filled(self->result, part->vertex_pixel[i]))) {
            continue;
        }
        const struct values values = {
            {point->z_um > 0 ? (uint32_t)point->z_um : 0, point->sigma_um}};
        count_digits(self, &values);
        if (self->kept != NULL) {
            INVARIANT(self->kept_count < self->kept_room);
            self->kept[self->kept_count++] = values;
        }
    }
}

/// Each digit's walk would make all points again: they are kept where the surface itself took more
/// memory before.
static struct values *take_kept(const struct reconstruct_result *result, uint32_t points,
                                struct arena *arena) {
    const size_t bytes = arena_need_bytes(points, sizeof(struct values));
    return result->points == NULL && arena->used_bytes + bytes <= result->arena_peak_bytes
               ? arena_take(arena, points, sizeof(struct values))
               : NULL;
}

static void count_all(struct spread *self) {
    if (self->kept_count == 0) {
        surface_walk(self->result, SURFACE_POINTS, count_part, self);
        return;
    }
    for (uint32_t i = 0; i < self->kept_count; i++) {
        count_digits(self, &self->kept[i]);
    }
}

static void find_digits(struct quantiles *self) {
    for (int k = 0; k < SURFACE_FIGURES_QUANTILES; k++) {
        const uint32_t digit = find_rank(self->counts[k], &self->rank[k]);
        self->found[k] = self->found[k] << DIGIT_BITS | digit;
    }
    memset(self->counts, 0, sizeof self->counts);
}

/// Looks for the values that `percent` of the points do not exceed.
static void start(struct quantiles *self, const int *percent, uint32_t points) {
    for (int k = 0; k < SURFACE_FIGURES_QUANTILES; k++) {
        self->rank[k] = (uint32_t)((uint64_t)(points - 1) * (uint32_t)percent[k] / 100);
    }
}

bool surface_figures_find_spread(const struct reconstruct_result *result,
                                 const struct surface_figures_depths *depths, uint32_t points,
                                 struct arena *arena, struct surface_figures_spread *spread) {
    static const int depth_percent[SURFACE_FIGURES_QUANTILES] = {1, 50, 99};
    static const int sigma_percent[SURFACE_FIGURES_QUANTILES] = {5, 50, 95};
    static const struct surface_figures_depths all = {INT32_MIN, INT32_MAX};
    const size_t mark = arena_mark(arena);
    struct spread *self = arena_take(arena, 1, sizeof *self);
    INVARIANT(points > 0);
    if (self == NULL) {
        return false;
    }
    memset(self, 0, sizeof *self);
    self->result = result;
    self->depths = depths != NULL ? *depths : all;
    self->kept = take_kept(result, points, arena);
    self->kept_room = points;
    start(&self->quantiles[DEPTH], depth_percent, points);
    start(&self->quantiles[SIGMA], sigma_percent, points);
    for (self->shift = FIRST_SHIFT; self->shift >= 0; self->shift -= DIGIT_BITS) {
        count_all(self);
        find_digits(&self->quantiles[DEPTH]);
        find_digits(&self->quantiles[SIGMA]);
    }
    for (int k = 0; k < SURFACE_FIGURES_QUANTILES; k++) {
        spread->depth_mm[k] = self->quantiles[DEPTH].found[k] / 1000.0;
        spread->sigma_mm[k] = self->quantiles[SIGMA].found[k] / 1000.0;
    }
    arena_release(arena, mark);
    return true;
}

size_t surface_figures_spread_need_bytes(void) {
    return arena_need_bytes(1, sizeof(struct spread));
}

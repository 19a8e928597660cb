// SPDX-License-Identifier: Apache-2.0
// After the last band (included by match_plain.c and the other kernel sets): medians of three
// disparities along the columns, and, where a row of the finest level covers two rows of the image,
// the rows between. Columns are independent of each other.
#ifndef VERGENCE_STEREO_MATCH_MATCH_FINISH_PHASE_H
#define VERGENCE_STEREO_MATCH_MATCH_FINISH_PHASE_H

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/match_state.h"

static inline int32_t median_of_three(int32_t a, int32_t b, int32_t c) {
    const int32_t low = a < b ? a : b;
    const int32_t high = a < b ? b : a;
    const int32_t inner = c < high ? c : high;
    return inner > low ? inner : low;
}

// `here` becomes the median of itself, the row before, at `raw`, and the next one; `raw` becomes
// the old `here`.
static void smooth_row(int32_t *restrict raw, int32_t *restrict here, const int32_t *restrict next,
                       int columns) {
    for (int x = 0; x < columns; x++) {
        const int32_t was = here[x];
        here[x] = median_of_three(raw[x], was, next[x]);
        raw[x] = was;
    }
}

// The two image rows between the middles of two rows of the level: a quarter of the other one where
// both lie on one surface.

static void fill_between(int32_t *restrict upper, int32_t *restrict lower, int columns) {
    enum { SURFACE_STEP_Q8 = 256 };
    for (int x = 0; x < columns; x++) {
        const int32_t rise = lower[x] - upper[x];
        const int32_t part = rise <= SURFACE_STEP_Q8 && rise >= -SURFACE_STEP_Q8 ? rise / 4 : 0;
        upper[x] += part;
        lower[x] -= part;
    }
}

static void finish(const struct match_level *level, struct match_scratch *scratch, int x_begin,
                   int x_end) {
    const struct image_i32 *disparity = &level->state->output->disparity_q8;
    const int columns = x_end - x_begin;
    // After a cancelled run only some rows exist.
    const int rows = level->rows_done;
    const int last = rows - 1;
    const int shift = level->shift_y;
    INVARIANT(columns >= 0 && last >= 0 && shift <= 1);
    int32_t *raw = scratch->finish;
    memcpy(raw, image_i32_row(disparity, 0) + x_begin, (size_t)columns * sizeof *raw);
    for (int y = 0; y < last; y++) {
        smooth_row(raw, image_i32_row(disparity, y << shift) + x_begin,
                   image_i32_row(disparity, (y + 1) << shift) + x_begin, columns);
    }
    for (int y = 0; y < rows && shift > 0; y++) {
        int32_t *upper = image_i32_row(disparity, 2 * y) + x_begin;
        int32_t *lower = image_i32_row(disparity, 2 * y + 1) + x_begin;
        memcpy(lower, upper, (size_t)columns * sizeof *lower);
        if (y > 0) {
            fill_between(image_i32_row(disparity, 2 * y - 1) + x_begin, upper, columns);
        }
    }
    for (int y = rows << shift; rows == level->height && y < disparity->height; y++) {
        memcpy(image_i32_row(disparity, y) + x_begin, image_i32_row(disparity, y - 1) + x_begin,
               (size_t)columns * sizeof *raw);
    }
}

#endif

// SPDX-License-Identifier: Apache-2.0
// Phase 2 (included by match_plain.c and its like): edge-aware averages down the columns and, with
// a bounded look-ahead, up; then the dynamic-programming message from the row above. Columns do not
// depend on each other.
#ifndef VERGENCE_CORE_MATCH_COLUMN_PHASE_H
#define VERGENCE_CORE_MATCH_COLUMN_PHASE_H

#include <string.h>

#include "core/invariant.h"
#include "core/match_state.h"

static int grey_step(const struct match_state *state, int x, int y) {
    const struct image_u8 *left = &state->input->left;
    const int here = image_u8_row(left, y)[x];
    const int above = image_u8_row(left, y - 1)[x];
    return here > above ? here - above : above - here;
}

static uint8_t *ring_cell(const struct match_state *state, int x, int y) {
    return state->ring[y % MATCH_RING_ROWS] + (ptrdiff_t)x * state->lanes;
}

static uint8_t *above_cell(const struct match_state *state, int x, int y) {
    return state->from_above[1 + y - state->band_begin] + (ptrdiff_t)x * state->lanes;
}

// Both passes go through a strip of MATCH_STRIP_COLUMNS columns row by row: neighbouring columns do
// not wait for each other, and the strip's rows stay in the fastest memory.

// Leaves in above_cell(x, y) the average of the rows below y (those that have arrived) and in
// mass_below[] its mass as it arrives at each row of the band.
MATCH_INLINE void average_upwards(struct match_state *state, uint8_t *running, int x_begin,
                                  int x_end, const int lanes,
                                  uint16_t mass_below[MATCH_BAND_ROWS][MATCH_STRIP_COLUMNS]) {
    const int last = state->cost_end - 1;
    uint32_t mass[MATCH_STRIP_COLUMNS];
    for (int x = x_begin; x < x_end; x++) {
        memcpy(running + (ptrdiff_t)(x - x_begin) * lanes, ring_cell(state, x, last),
               (size_t)lanes);
        mass[x - x_begin] = MATCH_MASS_ONE;
        if (last < state->band_end) {
            mass_below[last - state->band_begin][x - x_begin] = 0;
        }
    }
    for (int y = last - 1; y >= state->band_begin; y--) {
        for (int x = x_begin; x < x_end; x++) {
            const int column = x - x_begin;
            uint8_t *average = running + (ptrdiff_t)column * lanes;
            const uint32_t carried =
                match_carry(mass[column], state->weight_of_step[grey_step(state, x, y + 1)]);
            if (y < state->band_end) {
                memcpy(above_cell(state, x, y), average, (size_t)lanes);
                mass_below[y - state->band_begin][column] = (uint16_t)carried;
            }
            lanes_blend_leaning(average, ring_cell(state, x, y),
                                match_share(state, carried, MATCH_MASS_ONE), lanes, average);
            mass[column] = MATCH_MASS_ONE + carried;
        }
    }
}

// The first row of the image has nothing above it.
MATCH_INLINE void begin_column(struct match_state *state, int x, uint32_t below, const int lanes) {
    uint8_t *down = state->down + (ptrdiff_t)x * lanes;
    uint8_t *cost = ring_cell(state, x, 0);
    uint8_t *message = above_cell(state, x, 0);
    memcpy(down, cost, (size_t)lanes);
    state->down_mass[x] = MATCH_MASS_ONE;
    if (below != 0) {
        lanes_blend_leaning(message, down, match_share(state, below, MATCH_MASS_ONE), lanes, cost);
    }
    memcpy(message, cost, (size_t)lanes);
    state->above_lowest[x] = (uint8_t)lanes_lowest(cost, lanes);
}

MATCH_INLINE void continue_column(struct match_state *state, int x, int y, uint32_t below,
                                  const int lanes) {
    uint8_t *down = state->down + (ptrdiff_t)x * lanes;
    uint8_t *cost = ring_cell(state, x, y);
    uint8_t *message = above_cell(state, x, y);
    const int step = grey_step(state, x, y);
    const uint32_t carried = match_carry(state->down_mass[x], state->weight_of_step[step]);
    lanes_blend_leaning(down, cost, match_share(state, carried, MATCH_MASS_ONE), lanes, down);
    const uint32_t mass = MATCH_MASS_ONE + carried;
    state->down_mass[x] = (uint16_t)mass;
    if (below == 0) {
        memcpy(cost, down, (size_t)lanes);
    } else {
        lanes_blend_leaning(message, down, match_share(state, below, mass), lanes, cost);
    }
    const struct match_penalties penalties = {MATCH_PENALTY_SMALL, state->large_of_step[step]};
    const uint8_t *previous = state->from_above[y - state->band_begin] + (ptrdiff_t)x * lanes;
    state->above_lowest[x] =
        (uint8_t)lanes_message(cost, previous, state->above_lowest[x], penalties, lanes, message);
}

MATCH_INLINE void strip(struct match_state *state, struct match_scratch *scratch, int x_begin,
                        int x_end, const int lanes) {
    uint16_t mass_below[MATCH_BAND_ROWS][MATCH_STRIP_COLUMNS];
    average_upwards(state, scratch->strip, x_begin, x_end, lanes, mass_below);
    for (int y = state->band_begin; y < state->band_end; y++) {
        const uint16_t *below = mass_below[y - state->band_begin];
        for (int x = x_begin; x < x_end; x++) {
            if (y == 0) {
                begin_column(state, x, below[x - x_begin], lanes);
            } else {
                continue_column(state, x, y, below[x - x_begin], lanes);
            }
        }
    }
}

MATCH_INLINE void columns_of(struct match_state *state, struct match_scratch *scratch, int x_begin,
                             int x_end, const int lanes) {
    INVARIANT(state->cost_end >= state->band_end);
    for (int x = x_begin; x < x_end; x += MATCH_STRIP_COLUMNS) {
        const int end = x + MATCH_STRIP_COLUMNS < x_end ? x + MATCH_STRIP_COLUMNS : x_end;
        strip(state, scratch, x, end, lanes);
    }
}

static void columns(struct match_state *state, struct match_scratch *scratch, int x_begin,
                    int x_end) {
#define COLUMNS_OF(lanes) columns_of(state, scratch, x_begin, x_end, lanes)
    MATCH_WITH_CONSTANT_LANES(state->lanes, COLUMNS_OF);
#undef COLUMNS_OF
}

#endif

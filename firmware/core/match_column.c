// SPDX-License-Identifier: Apache-2.0
// Phase 2: edge-aware averages down the columns and, with a bounded look-ahead, up; then the
// dynamic-programming message from the row above. Columns do not depend on each other.
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
    return state->from_above[1 + y - state->band_begin] + 1 + (ptrdiff_t)x * state->message_stride;
}

// Leaves in above_cell(x, y) the average of the rows below y (those that have arrived), and returns in
// mass[] its mass as it arrives at each row of the band.
static void average_upwards(struct match_state *state, uint8_t *running, int x,
                            uint32_t mass[MATCH_BAND_ROWS]) {
    const int lanes = state->lanes;
    const int last = state->cost_end - 1;
    memcpy(running, ring_cell(state, x, last), (size_t)lanes);
    uint32_t running_mass = MATCH_MASS_ONE;
    if (last < state->band_end) {
        mass[last - state->band_begin] = 0;
    }
    for (int y = last - 1; y >= state->band_begin; y--) {
        const uint32_t carried =
            match_carry(running_mass, state->weight_of_step[grey_step(state, x, y + 1)]);
        if (y < state->band_end) {
            memcpy(above_cell(state, x, y), running, (size_t)lanes);
            mass[y - state->band_begin] = carried;
        }
        state->kernels->blend(running, ring_cell(state, x, y), match_share(carried, MATCH_MASS_ONE),
                              lanes, running);
        running_mass = MATCH_MASS_ONE + carried;
    }
}

static void column(struct match_state *state, uint8_t *running, int x) {
    const struct match_kernels *kernels = state->kernels;
    const int lanes = state->lanes;
    uint32_t mass_below[MATCH_BAND_ROWS];
    average_upwards(state, running, x, mass_below);

    uint8_t *down = state->down + (ptrdiff_t)x * lanes;
    for (int y = state->band_begin; y < state->band_end; y++) {
        uint8_t *cost = ring_cell(state, x, y);
        uint8_t *message = above_cell(state, x, y);
        const uint32_t below = mass_below[y - state->band_begin];
        if (y == 0) {
            memcpy(down, cost, (size_t)lanes);
            state->down_mass[x] = MATCH_MASS_ONE;
        } else {
            const uint32_t carried = match_carry(state->down_mass[x],
                                                 state->weight_of_step[grey_step(state, x, y)]);
            kernels->blend(down, cost, match_share(carried, MATCH_MASS_ONE), lanes, down);
            state->down_mass[x] = (uint16_t)(MATCH_MASS_ONE + carried);
        }
        if (below == 0) {
            memcpy(cost, down, (size_t)lanes);
        } else {
            kernels->blend(down, message, match_share(state->down_mass[x], below), lanes, cost);
        }
        if (y == 0) {
            memcpy(message, cost, (size_t)lanes);
            uint8_t lowest = UINT8_MAX;
            for (int i = 0; i < lanes; i++) {
                lowest = cost[i] < lowest ? cost[i] : lowest;
            }
            state->above_lowest[x] = lowest;
        } else {
            const struct match_penalties penalties = {
                MATCH_PENALTY_SMALL, state->large_of_step[grey_step(state, x, y)]};
            const uint8_t *previous =
                state->from_above[y - state->band_begin] + 1 + (ptrdiff_t)x * state->message_stride;
            state->above_lowest[x] = (uint8_t)kernels->message(
                cost, previous, state->above_lowest[x], penalties, lanes, message);
        }
    }
}

void match_columns(struct match_state *state, struct match_scratch *scratch, int x_begin,
                   int x_end) {
    INVARIANT(state->cost_end >= state->band_end);
    for (int x = x_begin; x < x_end; x++) {
        column(state, scratch->column, x);
    }
}

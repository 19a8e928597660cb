// SPDX-License-Identifier: Apache-2.0
// Phase 3 (included by match_plain.c and its like): messages along the row from both sides, the
// winner of their sum, sub-pixel position, left-right consistency and the reason why a pixel has no
// disparity.
#ifndef VERGENCE_CORE_MATCH_ROW_PHASE_H
#define VERGENCE_CORE_MATCH_ROW_PHASE_H

#include <string.h>

#include "core/invariant.h"
#include "core/match_state.h"
#include "core/reason.h"

enum {
    DISPARITY_ONE = 256,
    // A winner that beats its best rival by less than this is wrong more often than one in four
    // times (measured on ten pairs with ground truth).
    MARGIN_MIN = 24,
    // Averaged cost of a winner: 99 % of the right ones on the same pairs stay below; images that
    // have nothing to do with each other mostly lie above.
    FIT_MAX = 40,
    TEXTURE_RADIUS = 8,  // along the row
    TEXTURE_MIN = 6,     // grey levels between the darkest and the brightest pixel
};

// Large penalty between x - 1 and x of row y.
static uint8_t large_between(const struct match_state *state, const uint8_t *guide, int x) {
    const int step = guide[x] > guide[x - 1] ? guide[x] - guide[x - 1] : guide[x - 1] - guide[x];
    return state->large_of_step[step];
}

// Indices whose right pixel lies inside the right row's span.
static void searched(const struct match_state *state, struct rectify_span right, int x, int *begin,
                     int *end) {
    const int first = x - state->options.disparity_min - right.end + 1;
    const int beyond = x - state->options.disparity_min - right.begin + 1;
    *begin = first > 0 ? first : 0;
    *end = beyond < state->options.disparity_count ? beyond : state->options.disparity_count;
}

// Offset of the lowest point of the "V" through three costs, in 1/256 of a disparity, [-128, 128].
// It is taken from the averaged costs: the messages' sums hold the penalty for leaving a whole
// disparity, which would pull every offset towards 0 (by 0.15 px, measured).
static int sub_pixel_q8(int before, int middle, int after) {
    const int rise_before = before - middle;
    const int rise_after = after - middle;
    const int steeper = rise_before > rise_after ? rise_before : rise_after;
    const int fall = rise_before - rise_after;
    if (steeper <= 0 || fall >= steeper || -fall >= steeper) {
        // The messages overruled a lower neighbour: half way is as far as they may be overruled.
        return fall == 0 ? 0 : (fall < 0 ? -(DISPARITY_ONE / 2) : DISPARITY_ONE / 2);
    }
    return fall * (DISPARITY_ONE / 2) / steeper;
}

// One row on its way through the phase.
struct row_view {
    struct match_line *line;  // its scratch
    const uint8_t *guide;     // left grey values
    const uint8_t *cost, *above;
    int32_t *disparity_q8;
    uint8_t *reason, *confidence;
    struct rectify_span left, right;
};

MATCH_INLINE void decide(const struct match_state *state, const struct row_view *view, int x,
                         const uint8_t *from_right, const int lanes) {
    struct match_line *line = view->line;
    const ptrdiff_t cell = (ptrdiff_t)x * lanes;
    int begin;
    int end;
    searched(state, view->right, x, &begin, &end);
    if (x < view->left.begin || x >= view->left.end || begin >= end) {
        view->reason[x] = REASON_BORDER;
        view->confidence[x] = 0;
        view->disparity_q8[x] = DISPARITY_ONE * state->options.disparity_min;
        line->index[x] = -1;
        return;
    }
    uint16_t *sum = line->sum;
    const struct match_winner winner =
        lanes_winner(view->above + cell, line->cells + cell, from_right, lanes, begin, end, sum);
    const int i = winner.index;
    int offset_q8 = 0;
    if (i > begin && i + 1 < end) {
        const uint8_t *cost = view->cost + cell + i;
        offset_q8 = sub_pixel_q8(cost[-1], cost[0], cost[1]);
    }
    line->index[x] = (int16_t)i;
    view->disparity_q8[x] = DISPARITY_ONE * (state->options.disparity_min + i) + offset_q8;
    const int margin = winner.rival - winner.lowest;
    view->confidence[x] = (uint8_t)(margin > UINT8_MAX ? UINT8_MAX : margin);
    view->reason[x] = REASON_VALID;
    const int right_x = x - state->options.disparity_min - i;
    INVARIANT(right_x >= view->right.begin && right_x < view->right.end);
    if (winner.lowest < line->right_lowest[right_x]) {
        line->right_lowest[right_x] = winner.lowest;
        line->right_index[right_x] = (int16_t)i;
    }
}

static bool textured(const uint8_t *guide, struct rectify_span span, int x) {
    const int begin = x - TEXTURE_RADIUS > span.begin ? x - TEXTURE_RADIUS : span.begin;
    const int end = x + TEXTURE_RADIUS + 1 < span.end ? x + TEXTURE_RADIUS + 1 : span.end;
    uint8_t darkest = UINT8_MAX;
    uint8_t brightest = 0;
    for (int i = begin; i < end; i++) {
        darkest = guide[i] < darkest ? guide[i] : darkest;
        brightest = guide[i] > brightest ? guide[i] : brightest;
    }
    return brightest - darkest >= TEXTURE_MIN;
}

static bool consistent(const struct match_line *line, int right_x, int i) {
    const int gap = line->right_index[right_x] - i;
    return gap <= 1 && gap >= -1;
}

// Why the winner of pixel x is not to be believed, or REASON_VALID.
static enum reason judge(const struct match_state *state, const struct row_view *view, int x) {
    const int i = view->line->index[x];
    const int count = state->options.disparity_count;
    if (!consistent(view->line, x - state->options.disparity_min - i, i)) {
        return REASON_OCCLUDED;
    }
    const bool fits = view->cost[(ptrdiff_t)x * state->lanes + i] <= FIT_MAX;
    const bool at_end = count > 2 && (i == 0 || i == count - 1);
    const bool distinct = view->confidence[x] >= MARGIN_MIN;
    if (fits && !at_end && distinct) {
        return REASON_VALID;
    }
    if (!textured(view->guide, view->left, x)) {
        return REASON_NO_TEXTURE;
    }
    return fits && !at_end ? REASON_AMBIGUOUS : REASON_OUT_OF_RANGE;
}

static void vet_row(const struct match_state *state, const struct row_view *view) {
    for (int x = view->left.begin; x < view->left.end; x++) {
        if (view->reason[x] == REASON_VALID) {
            view->reason[x] = (uint8_t)judge(state, view, x);
        }
    }
}

// Two rows go side by side: each waits for its own previous pixel, not for the other row.

MATCH_INLINE void messages_from_left(const struct match_state *state, const struct row_view *views,
                                     const int rows, const int lanes) {
    int lowest[MATCH_ROWS_ABREAST];
    for (int r = 0; r < rows; r++) {
        memcpy(views[r].line->cells, views[r].cost, (size_t)lanes);
        lowest[r] = lanes_lowest(views[r].cost, lanes);
    }
    for (int x = 1; x < state->width; x++) {
        const ptrdiff_t cell = (ptrdiff_t)x * lanes;
        for (int r = 0; r < rows; r++) {
            const struct match_penalties penalties = {MATCH_PENALTY_SMALL,
                                                      large_between(state, views[r].guide, x)};
            uint8_t *message = views[r].line->cells + cell;
            lowest[r] = lanes_message(views[r].cost + cell, message - lanes, lowest[r], penalties,
                                      lanes, message);
        }
    }
}

// Messages from the right, each summed with the others and decided as it comes.
MATCH_INLINE void messages_from_right(const struct match_state *state, const struct row_view *views,
                                      const int rows, const int lanes) {
    const int last = state->width - 1;
    int lowest[MATCH_ROWS_ABREAST];
    for (int r = 0; r < rows; r++) {
        uint8_t *message = views[r].line->message[last & 1];
        memcpy(message, views[r].cost + (ptrdiff_t)last * lanes, (size_t)lanes);
        lowest[r] = lanes_lowest(message, lanes);
        decide(state, &views[r], last, message, lanes);
    }
    for (int x = last - 1; x >= 0; x--) {
        const ptrdiff_t cell = (ptrdiff_t)x * lanes;
        for (int r = 0; r < rows; r++) {
            const struct match_penalties penalties = {MATCH_PENALTY_SMALL,
                                                      large_between(state, views[r].guide, x + 1)};
            const uint8_t *previous = views[r].line->message[(x + 1) & 1];
            uint8_t *message = views[r].line->message[x & 1];
            lowest[r] =
                lanes_message(views[r].cost + cell, previous, lowest[r], penalties, lanes, message);
            decide(state, &views[r], x, message, lanes);
        }
    }
}

MATCH_INLINE void messages(const struct match_state *state, const struct row_view *views, int rows,
                           const int lanes) {
    if (rows == MATCH_ROWS_ABREAST) {
        messages_from_left(state, views, MATCH_ROWS_ABREAST, lanes);
        messages_from_right(state, views, MATCH_ROWS_ABREAST, lanes);
    } else {
        messages_from_left(state, views, 1, lanes);
        messages_from_right(state, views, 1, lanes);
    }
}

static struct row_view view_row(const struct match_state *state, struct match_line *line, int y) {
    const struct match_input *input = state->input;
    const struct rectify_span whole = {0, (int16_t)state->width};
    for (int x = 0; x < state->width; x++) {
        line->right_lowest[x] = UINT16_MAX;
        line->right_index[x] = -1;
    }
    return (struct row_view){
        .line = line,
        .guide = image_u8_row(&input->left, y),
        .cost = state->ring[y % MATCH_RING_ROWS],
        .above = state->from_above[1 + y - state->band_begin],
        .disparity_q8 = image_i32_row(&state->output->disparity_q8, y),
        .reason = image_u8_row(&state->output->reason, y),
        .confidence = image_u8_row(&state->output->confidence, y),
        .left = input->left_span == NULL ? whole : input->left_span[y],
        .right = input->right_span == NULL ? whole : input->right_span[y],
    };
}

static void rows(struct match_state *state, struct match_scratch *scratch, int y_begin, int y_end) {
    for (int y = y_begin; y < y_end; y += MATCH_ROWS_ABREAST) {
        const int abreast = y + MATCH_ROWS_ABREAST <= y_end ? MATCH_ROWS_ABREAST : 1;
        INVARIANT(abreast == y_end - y || abreast == MATCH_ROWS_ABREAST);
        INVARIANT(state->lanes >= MATCH_LANES);
        struct row_view views[MATCH_ROWS_ABREAST];
        for (int r = 0; r < abreast; r++) {
            views[r] = view_row(state, &scratch->line[r], y + r);
        }
#define MESSAGES(lanes) messages(state, views, abreast, lanes)
        MATCH_WITH_CONSTANT_LANES(state->lanes, MESSAGES);
#undef MESSAGES
        for (int r = 0; r < abreast && !state->options.keep_all; r++) {
            vet_row(state, &views[r]);
        }
    }
}

#endif

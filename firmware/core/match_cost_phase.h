// SPDX-License-Identifier: Apache-2.0
// Phase 1 (included by match_plain.c and its like): features of a row, cost of every disparity,
// edge-aware average along the row.
#ifndef VERGENCE_CORE_MATCH_COST_PHASE_H
#define VERGENCE_CORE_MATCH_COST_PHASE_H

#include <string.h>

#include "core/invariant.h"
#include "core/match_state.h"

static int clamp_int(int value, int low, int high) {
    return value < low ? low : (value > high ? high : value);
}

// Copies a row so that index x of `padded` (which starts MATCH_CENSUS_RADIUS before the image) is
// pixel x, with the ends of the valid span repeated outwards.
static void pad_row(const struct image_u8 *image, const struct rectify_span *spans, int y,
                    uint8_t *padded) {
    const int row = clamp_int(y, 0, image->height - 1);
    const struct rectify_span whole = {0, (int16_t)image->width};
    const struct rectify_span span = spans == NULL ? whole : spans[row];
    const uint8_t *pixels = image_u8_row(image, row);
    const int padded_width = image->width + 2 * MATCH_CENSUS_RADIUS;
    if (span.begin >= span.end) {
        memset(padded, 0, (size_t)padded_width);
        return;
    }
    const int front = span.begin + MATCH_CENSUS_RADIUS;
    const int length = span.end - span.begin;
    memset(padded, pixels[span.begin], (size_t)front);
    memcpy(padded + front, pixels + span.begin, (size_t)length);
    memset(padded + front + length, pixels[span.end - 1], (size_t)(padded_width - front - length));
}

// Eight comparisons with the centre, a bit each. offset[] holds (row, column) of the neighbours.
static void census_plane(uint8_t *const window[], const int8_t offset[8][2], int width,
                         uint8_t *restrict plane) {
    const uint8_t *restrict centre = window[MATCH_CENSUS_RADIUS] + MATCH_CENSUS_RADIUS;
    const uint8_t *neighbour[8];
    for (int i = 0; i < 8; i++) {
        neighbour[i] = window[offset[i][0]] + offset[i][1];
    }
    for (int x = 0; x < width; x++) {
        uint8_t bits = 0;
        for (int i = 0; i < 8; i++) {
            bits = (uint8_t)(bits | (neighbour[i][x] > centre[x] ? 1 << i : 0));
        }
        plane[x] = bits;
    }
}

// Census of the 5x5 window (R. Zabih and J. Woodfill, ECCV 1994) and the Sobel gradient along
// the row, of `width` pixels.
static void compute_features(uint8_t *const window[], int width, struct match_features *features) {
    static const int8_t neighbours[MATCH_CENSUS_PLANES][8][2] = {
        {{0, 0}, {0, 1}, {0, 2}, {0, 3}, {0, 4}, {1, 0}, {1, 1}, {1, 2}},
        {{1, 3}, {1, 4}, {2, 0}, {2, 1}, {2, 3}, {2, 4}, {3, 0}, {3, 1}},
        {{3, 2}, {3, 3}, {3, 4}, {4, 0}, {4, 1}, {4, 2}, {4, 3}, {4, 4}},
    };
    for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
        census_plane(window, neighbours[plane], width, features->census[plane]);
    }
    const uint8_t *restrict above = window[1] + 1;
    const uint8_t *restrict row = window[2] + 1;
    const uint8_t *restrict below = window[3] + 1;
    uint8_t *restrict gradient = features->gradient;
    for (int x = 0; x < width; x++) {
        const int16_t slope = (int16_t)(above[x + 2] - above[x] + 2 * (row[x + 2] - row[x]) +
                                        below[x + 2] - below[x]);
        const int16_t shifted = (int16_t)(128 + slope / 4);
        gradient[x] = (uint8_t)(shifted < 0 ? 0 : (shifted > 255 ? 255 : shifted));
    }
}

// Turns a feature row round and repeats its ends: index i of the result is
// right pixel (width - 1 + pad) - i.
static void reverse_feature(uint8_t *feature, int width, int pad, int total) {
    for (int i = 0, j = width - 1; i < j; i++, j--) {
        const uint8_t kept = feature[i];
        feature[i] = feature[j];
        feature[j] = kept;
    }
    memmove(feature + pad, feature, (size_t)width);
    memset(feature, feature[pad], (size_t)pad);
    const uint8_t last = feature[pad + width - 1];
    memset(feature + pad + width, last, (size_t)(total - pad - width));
}

static void prepare_features(const struct match_state *state, struct match_scratch *scratch,
                             int y) {
    const struct match_input *input = state->input;
    for (int j = 0; j <= 2 * MATCH_CENSUS_RADIUS; j++) {
        pad_row(&input->right, input->right_span, y + j - MATCH_CENSUS_RADIUS, scratch->window[j]);
    }
    compute_features(scratch->window, state->width, &scratch->right);
    const int total = state->width + state->right_pad_total;
    for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
        reverse_feature(scratch->right.census[plane], state->width, state->right_pad, total);
    }
    reverse_feature(scratch->right.gradient, state->width, state->right_pad, total);

    for (int j = 0; j <= 2 * MATCH_CENSUS_RADIUS; j++) {
        pad_row(&input->left, input->left_span, y + j - MATCH_CENSUS_RADIUS, scratch->window[j]);
    }
    compute_features(scratch->window, state->width, &scratch->left);
    const uint8_t *guide = scratch->window[MATCH_CENSUS_RADIUS] + MATCH_CENSUS_RADIUS;
    scratch->weight[0] = 0;
    for (int x = 1; x < state->width; x++) {
        const int step =
            guide[x] > guide[x - 1] ? guide[x] - guide[x - 1] : guide[x - 1] - guide[x];
        scratch->weight[x] = state->weight_of_step[step];
    }
    scratch->weight[state->width] = 0;
}

MATCH_INLINE void average_row(struct match_state *state, struct match_scratch *scratch, int y,
                              const int lanes) {
    const int count = state->options.disparity_count;
    uint8_t *row = state->ring[y % MATCH_RING_ROWS];

    // Forward: row[x] = average of the costs up to x, weighed by the edges between.
    uint32_t mass = 0;
    for (int x = 0; x < state->width; x++) {
        uint8_t *cost = scratch->cells + (ptrdiff_t)x * lanes;
        uint8_t *forward = row + (ptrdiff_t)x * lanes;
        const int right_index =
            state->width - 1 - x + state->options.disparity_min + state->right_pad;
        INVARIANT(right_index >= 0);
        lanes_cost(&scratch->left, x, &scratch->right, right_index, lanes, cost);
        for (int i = count; i < lanes; i++) {
            cost[i] = MATCH_COST_MAX;
        }
        const uint32_t carried = match_carry(mass, scratch->weight[x]);
        if (x == 0) {
            memcpy(forward, cost, (size_t)lanes);
        } else {
            lanes_blend(forward - lanes, cost, match_share(state, carried, MATCH_MASS_ONE), lanes,
                        forward);
        }
        mass = MATCH_MASS_ONE + carried;
        scratch->mass[x] = (uint16_t)mass;
    }

    // Backward: the average of the costs from the right up to x + 1 joins row[x].
    uint8_t *backward = scratch->cells + (ptrdiff_t)(state->width - 1) * lanes;
    mass = MATCH_MASS_ONE;
    for (int x = state->width - 2; x >= 0; x--) {
        uint8_t *forward = row + (ptrdiff_t)x * lanes;
        uint8_t *cost = scratch->cells + (ptrdiff_t)x * lanes;
        const uint32_t carried = match_carry(mass, scratch->weight[x + 1]);
        lanes_blend(forward, backward, match_share(state, scratch->mass[x], carried), lanes,
                    forward);
        lanes_blend(backward, cost, match_share(state, carried, MATCH_MASS_ONE), lanes, cost);
        backward = cost;
        mass = MATCH_MASS_ONE + carried;
    }
}

static void cost_row(struct match_state *state, struct match_scratch *scratch, int y) {
    prepare_features(state, scratch, y);
#define AVERAGE_ROW(lanes) average_row(state, scratch, y, lanes)
    MATCH_WITH_CONSTANT_LANES(state->lanes, AVERAGE_ROW);
#undef AVERAGE_ROW
}

#endif

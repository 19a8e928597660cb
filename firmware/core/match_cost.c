// SPDX-License-Identifier: Apache-2.0
// Phase 1: features of a row, cost of every disparity, edge-aware average along the row.
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

// Census of the 5x5 window (R. Zabih and J. Woodfill, ECCV 1994) and the Sobel gradient along
// the row, of `width` pixels.
static void compute_features(uint8_t *const window[], int width, struct match_features *features) {
    for (int x = 0; x < width; x++) {
        const uint8_t *rows[2 * MATCH_CENSUS_RADIUS + 1];
        for (int j = 0; j <= 2 * MATCH_CENSUS_RADIUS; j++) {
            rows[j] = window[j] + x;
        }
        const uint8_t centre = rows[2][2];
        uint32_t bits = 0;
        for (int j = 0; j < 5; j++) {
            for (int i = 0; i < 5; i++) {
                if (j != 2 || i != 2) {
                    bits = (bits << 1) | (rows[j][i] > centre);
                }
            }
        }
        features->census[0][x] = (uint8_t)bits;
        features->census[1][x] = (uint8_t)(bits >> 8);
        features->census[2][x] = (uint8_t)(bits >> 16);
        const int slope = (rows[1][3] - rows[1][1]) + 2 * (rows[2][3] - rows[2][1]) +
                          (rows[3][3] - rows[3][1]);
        features->gradient[x] = (uint8_t)clamp_int(128 + slope / 4, 0, 255);
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
        const int step = guide[x] > guide[x - 1] ? guide[x] - guide[x - 1] : guide[x - 1] - guide[x];
        scratch->weight[x] = state->weight_of_step[step];
    }
    scratch->weight[state->width] = 0;
}

void match_cost_row(struct match_state *state, struct match_scratch *scratch, int y) {
    const struct match_kernels *kernels = state->kernels;
    const int lanes = state->lanes;
    const int count = state->options.disparity_count;
    uint8_t *row = state->ring[y % MATCH_RING_ROWS];
    prepare_features(state, scratch, y);

    // Forward: row[x] = average of the costs up to x, weighed by the edges between.
    uint32_t mass = 0;
    for (int x = 0; x < state->width; x++) {
        uint8_t *cost = scratch->cost + (ptrdiff_t)x * lanes;
        uint8_t *forward = row + (ptrdiff_t)x * lanes;
        const int right_index =
            state->width - 1 - x + state->options.disparity_min + state->right_pad;
        INVARIANT(right_index >= 0);
        kernels->cost(&scratch->left, x, &scratch->right, right_index, lanes, cost);
        memset(cost + count, MATCH_COST_MAX, (size_t)(lanes - count));
        const uint32_t carried = match_carry(mass, scratch->weight[x]);
        if (x == 0) {
            memcpy(forward, cost, (size_t)lanes);
        } else {
            kernels->blend(forward - lanes, cost, match_share(carried, MATCH_MASS_ONE), lanes,
                           forward);
        }
        mass = MATCH_MASS_ONE + carried;
        scratch->mass[x] = (uint16_t)mass;
    }

    // Backward: the average of the costs from the right up to x + 1 joins row[x].
    uint8_t *backward = scratch->cost + (ptrdiff_t)(state->width - 1) * lanes;
    mass = MATCH_MASS_ONE;
    for (int x = state->width - 2; x >= 0; x--) {
        uint8_t *forward = row + (ptrdiff_t)x * lanes;
        uint8_t *cost = scratch->cost + (ptrdiff_t)x * lanes;
        const uint32_t carried = match_carry(mass, scratch->weight[x + 1]);
        kernels->blend(forward, backward, match_share(scratch->mass[x], carried), lanes, forward);
        kernels->blend(backward, cost, match_share(carried, MATCH_MASS_ONE), lanes, cost);
        backward = cost;
        mass = MATCH_MASS_ONE + carried;
    }
}

// SPDX-License-Identifier: Apache-2.0
/// Operations on the disparities ("lanes") of one pixel: the definition, in plain C written so that
/// compilers turn it into vector code. `count` is a multiple of MATCH_LANES.
#ifndef VERGENCE_CORE_MATCH_LANES_PLAIN_H
#define VERGENCE_CORE_MATCH_LANES_PLAIN_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "core/invariant.h"
#include "core/match_state.h"

static inline uint8_t lower_u8(uint8_t a, uint8_t b) {
    return a < b ? a : b;
}

// Bits set in the three bytes together: a carry-save adder first, so that two byte
// counts serve three bytes.
static inline uint8_t count_bits(uint8_t a, uint8_t b, uint8_t c) {
    uint8_t ones = (uint8_t)(a ^ b ^ c);
    uint8_t twos = (uint8_t)((a & b) | (c & (a ^ b)));
    ones = (uint8_t)(ones - ((ones >> 1) & 0x55));
    twos = (uint8_t)(twos - ((twos >> 1) & 0x55));
    ones = (uint8_t)((ones & 0x33) + ((ones >> 2) & 0x33));
    twos = (uint8_t)((twos & 0x33) + ((twos >> 2) & 0x33));
    const uint8_t both = (uint8_t)(ones + 2 * twos);
    return (uint8_t)((both & 0x0f) + (both >> 4));
}

// cost[i] of left pixel x against the right features at right_index + i:
// MATCH_CENSUS_WEIGHT a differing census bit, and the truncated difference of the gradients.
static inline void lanes_cost(const struct match_features *left, int x,
                              const struct match_features *right, int right_index, int count,
                              uint8_t *restrict cost) {
    const uint8_t *restrict right0 = right->census[0] + right_index;
    const uint8_t *restrict right1 = right->census[1] + right_index;
    const uint8_t *restrict right2 = right->census[2] + right_index;
    const uint8_t *restrict right_gradient = right->gradient + right_index;
    const uint8_t left0 = left->census[0][x];
    const uint8_t left1 = left->census[1][x];
    const uint8_t left2 = left->census[2][x];
    const uint8_t left_gradient = left->gradient[x];
    for (int i = 0; i < count; i++) {
        const uint8_t differing =
            count_bits(left0 ^ right0[i], left1 ^ right1[i], left2 ^ right2[i]);
        const uint8_t gradient = right_gradient[i];
        const uint8_t step = left_gradient > gradient ? (uint8_t)(left_gradient - gradient)
                                                      : (uint8_t)(gradient - left_gradient);
        cost[i] =
            (uint8_t)(MATCH_CENSUS_WEIGHT * differing + lower_u8(step, MATCH_GRADIENT_TRUNCATION));
    }
}

// result = (a wa + b (MATCH_WEIGHT_ONE - wa) + half) / MATCH_WEIGHT_ONE; `result` may be `a` or
// `b`.
static inline void lanes_blend(const uint8_t *a, const uint8_t *b, int wa, int count,
                               uint8_t *result) {
    INVARIANT(wa > 0 && wa < MATCH_WEIGHT_ONE);
    const uint16_t weight_a = (uint16_t)wa;
    const uint16_t weight_b = (uint16_t)(MATCH_WEIGHT_ONE - wa);
    for (int i = 0; i < count; i++) {
        const uint16_t mixed = (uint16_t)(a[i] * weight_a + b[i] * weight_b + MATCH_WEIGHT_ONE / 2);
        result[i] = (uint8_t)(mixed / MATCH_WEIGHT_ONE);
    }
}

// The same blend where each lane of `a` may be replaced by a neighbour's value plus MATCH_LEAN: an
// average along a surface that leans by up to a disparity a row, instead of one that stands
// upright.
static inline void lanes_blend_leaning(const uint8_t *a, const uint8_t *b, int wa, int count,
                                       uint8_t *result) {
    INVARIANT(count > 0 && count <= MATCH_MAX_DISPARITIES);
    INVARIANT(wa > 0 && wa < MATCH_WEIGHT_ONE);
    // `result` may be `a`, whose neighbours are still needed.
    uint8_t kept[MATCH_MAX_DISPARITIES + 2];
    kept[0] = UINT8_MAX;
    memcpy(kept + 1, a, (size_t)count);
    kept[count + 1] = UINT8_MAX;
    const uint16_t weight_a = (uint16_t)wa;
    const uint16_t weight_b = (uint16_t)(MATCH_WEIGHT_ONE - wa);
    for (int i = 0; i < count; i++) {
        const uint8_t beside = lower_u8(lower_u8(kept[i], kept[i + 2]), UINT8_MAX - MATCH_LEAN);
        const uint8_t leaning = lower_u8(kept[i + 1], (uint8_t)(beside + MATCH_LEAN));
        const uint16_t mixed =
            (uint16_t)(leaning * weight_a + b[i] * weight_b + MATCH_WEIGHT_ONE / 2);
        result[i] = (uint8_t)(mixed / MATCH_WEIGHT_ONE);
    }
}

// The dynamic-programming step: message[i] = cost[i] + min(p[i], p[i-1] + small, p[i+1] + small,
// large) with p = previous - lowest, its lowest value; neighbours beyond the ends count as
// infinite. Returns the lowest message. Source: H. Hirschmueller, "Stereo processing by semiglobal
// matching and mutual information", PAMI 30(2), 2008, equation 13.
static inline int lanes_message(const uint8_t *restrict cost, const uint8_t *restrict previous,
                                int lowest, struct match_penalties penalties, int count,
                                uint8_t *restrict message) {
    INVARIANT(lowest <= MATCH_COST_MAX && penalties.large <= MATCH_PENALTY_MAX);
    const uint8_t base = (uint8_t)lowest;
    const uint8_t small = penalties.small;
    const uint8_t large = penalties.large;
    // Everything above lowest + large loses to the jump: clipping there keeps all sums below 256.
    const uint8_t cap = (uint8_t)(base + large);
    uint8_t smallest = UINT8_MAX;
    for (int i = 0; i < count; i++) {
        const uint8_t before = i > 0 ? previous[i - 1] : UINT8_MAX;
        const uint8_t after = i + 1 < count ? previous[i + 1] : UINT8_MAX;
        const uint8_t same = (uint8_t)(lower_u8(previous[i], cap) - base);
        const uint8_t beside = (uint8_t)(lower_u8(lower_u8(before, after), cap) - base + small);
        const uint8_t value = (uint8_t)(cost[i] + lower_u8(lower_u8(beside, same), large));
        message[i] = value;
        smallest = lower_u8(smallest, value);
    }
    return smallest;
}

static inline int lanes_lowest(const uint8_t *values, int count) {
    uint8_t lowest = UINT8_MAX;
    for (int i = 0; i < count; i++) {
        lowest = lower_u8(lowest, values[i]);
    }
    return lowest;
}

// Sums a + b + c, and the winner among the indices [begin, end).
static inline struct match_winner lanes_winner(const uint8_t *restrict a, const uint8_t *restrict b,
                                               const uint8_t *restrict c, int count, int begin,
                                               int end, uint16_t *restrict sum) {
    INVARIANT(begin >= 0 && begin < end && end <= count);
    for (int i = 0; i < count; i++) {
        sum[i] = (uint16_t)(a[i] + b[i] + c[i]);
    }
    struct match_winner result = {.index = begin, .lowest = UINT16_MAX, .rival = UINT16_MAX};
    for (int i = begin; i < end; i++) {
        if (sum[i] < result.lowest) {
            result.lowest = sum[i];
            result.index = i;
        }
    }
    for (int i = begin; i < end; i++) {
        const bool beside = i >= result.index - 1 && i <= result.index + 1;
        if (!beside && sum[i] < result.rival) {
            result.rival = sum[i];
        }
    }
    return result;
}

#endif

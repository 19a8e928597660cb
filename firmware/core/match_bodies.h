// SPDX-License-Identifier: Apache-2.0
/// The definition of the matcher's inner loops, in plain C written so that compilers turn
/// them into vector code. Included by one file a processor level; see match_kernels.h.
#include <stddef.h>
#include <stdint.h>

#include "core/invariant.h"
#include "core/match_kernels.h"

enum { CENSUS_WEIGHT = 4, GRADIENT_TRUNCATION = 31 };

static inline uint8_t lower_u8(uint8_t a, uint8_t b) { return a < b ? a : b; }

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

static void cost_body(const struct match_features *left, int x, const struct match_features *right,
                      int right_index, int count, uint8_t *restrict cost) {
    INVARIANT(count % MATCH_LANES == 0);
    const uint8_t *restrict right0 = right->census[0] + right_index;
    const uint8_t *restrict right1 = right->census[1] + right_index;
    const uint8_t *restrict right2 = right->census[2] + right_index;
    const uint8_t *restrict right_gradient = right->gradient + right_index;
    const uint8_t left0 = left->census[0][x];
    const uint8_t left1 = left->census[1][x];
    const uint8_t left2 = left->census[2][x];
    const uint8_t left_gradient = left->gradient[x];
    for (int i = 0; i < count; i++) {
        const uint8_t differing = count_bits(left0 ^ right0[i], left1 ^ right1[i], left2 ^ right2[i]);
        const uint8_t higher = left_gradient > right_gradient[i] ? left_gradient : right_gradient[i];
        const uint8_t lower = left_gradient > right_gradient[i] ? right_gradient[i] : left_gradient;
        const uint8_t step = lower_u8((uint8_t)(higher - lower), GRADIENT_TRUNCATION);
        cost[i] = (uint8_t)(CENSUS_WEIGHT * differing + step);
    }
}

static void blend_body(const uint8_t *a, const uint8_t *b, int wa, int count, uint8_t *result) {
    INVARIANT(wa >= 0 && wa <= MATCH_WEIGHT_ONE);
    const uint16_t weight_a = (uint16_t)wa;
    const uint16_t weight_b = (uint16_t)(MATCH_WEIGHT_ONE - wa);
    for (int i = 0; i < count; i++) {
        const uint16_t mixed = (uint16_t)(a[i] * weight_a + b[i] * weight_b + MATCH_WEIGHT_ONE / 2);
        result[i] = (uint8_t)(mixed / MATCH_WEIGHT_ONE);
    }
}

static int message_body(const uint8_t *restrict cost, const uint8_t *restrict previous, int lowest,
                        struct match_penalties penalties, int count, uint8_t *restrict message) {
    INVARIANT(count % MATCH_LANES == 0);
    const uint8_t base = (uint8_t)lowest;
    const uint8_t small = penalties.small;
    const uint8_t large = penalties.large;
    // Everything above lowest + large loses to the jump: clipping there first keeps all
    // sums below 256.
    const uint8_t cap = (uint8_t)(base + large);
    uint8_t smallest = UINT8_MAX;
    for (int i = 0; i < count; i++) {
        const uint8_t same = (uint8_t)(lower_u8(previous[i], cap) - base);
        const uint8_t below = (uint8_t)(lower_u8(previous[i - 1], cap) - base + small);
        const uint8_t above = (uint8_t)(lower_u8(previous[i + 1], cap) - base + small);
        const uint8_t near = lower_u8(lower_u8(below, above), lower_u8(same, large));
        const uint8_t value = (uint8_t)(cost[i] + near);
        message[i] = value;
        smallest = lower_u8(smallest, value);
    }
    return smallest;
}

static void add_body(const uint8_t *restrict a, const uint8_t *restrict b, int count,
                     uint16_t *restrict sum) {
    for (int i = 0; i < count; i++) {
        sum[i] = (uint16_t)(a[i] + b[i]);
    }
}

static inline uint16_t lowest_in(const uint16_t *sum, int begin, int end) {
    uint16_t lowest = UINT16_MAX;
    for (int i = begin; i < end; i++) {
        lowest = sum[i] < lowest ? sum[i] : lowest;
    }
    return lowest;
}

static struct match_winner winner_body(uint16_t *restrict sum, const uint8_t *restrict last,
                                       int count, int begin, int end) {
    INVARIANT(begin >= 0 && begin < end && end <= count);
    for (int i = 0; i < count; i++) {
        sum[i] = (uint16_t)(sum[i] + last[i]);
    }
    struct match_winner result = {.lowest = lowest_in(sum, begin, end)};
    uint16_t index = UINT16_MAX;
    for (int i = begin; i < end; i++) {
        const uint16_t candidate = sum[i] == result.lowest ? (uint16_t)i : UINT16_MAX;
        index = candidate < index ? candidate : index;
    }
    result.index = index;
    const int before = index - 1 > begin ? index - 1 : begin;
    const int after = index + 2 < end ? index + 2 : end;
    const uint16_t rival_before = lowest_in(sum, begin, before);
    const uint16_t rival_after = lowest_in(sum, after, end);
    result.rival = rival_before < rival_after ? rival_before : rival_after;
    INVARIANT(result.index >= begin && result.index < end);
    return result;
}

// SPDX-License-Identifier: Apache-2.0
/// The operations of match_lanes_plain.h with SSE4.1: the same bytes.
#ifndef VERGENCE_CORE_MATCH_LANES_SSE41_H
#define VERGENCE_CORE_MATCH_LANES_SSE41_H

#include <smmintrin.h>
#include <stddef.h>
#include <stdint.h>

#include "core/invariant.h"
#include "core/match_state.h"

static inline __m128i load16(const void *from) {
    return _mm_loadu_si128((const __m128i *)from);
}
static inline void store16(void *to, __m128i value) {
    _mm_storeu_si128((__m128i *)to, value);
}

// Lowest byte in the low 8 bits of the result.
static inline int lowest16(__m128i value) {
    const __m128i pairs = _mm_min_epu8(value, _mm_srli_epi16(value, 8));
    const __m128i bytes = _mm_and_si128(pairs, _mm_set1_epi16(0xff));
    return _mm_cvtsi128_si32(_mm_minpos_epu16(bytes)) & 0xff;
}

// MATCH_CENSUS_WEIGHT times the bits set in three bytes: a carry-save adder, then table lookups by
// nibble that hold the weighted counts.
static inline __m128i weighted_bits16(__m128i a, __m128i b, __m128i c) {
    const __m128i low = _mm_set1_epi8(0x0f);
    const __m128i table = _mm_setr_epi8(0, 4, 4, 8, 4, 8, 8, 12, 4, 8, 8, 12, 8, 12, 12, 16);
    const __m128i half = _mm_xor_si128(a, b);
    const __m128i ones = _mm_xor_si128(half, c);
    const __m128i twos = _mm_or_si128(_mm_and_si128(a, b), _mm_and_si128(half, c));
    const __m128i ones_count =
        _mm_add_epi8(_mm_shuffle_epi8(table, _mm_and_si128(ones, low)),
                     _mm_shuffle_epi8(table, _mm_and_si128(_mm_srli_epi16(ones, 4), low)));
    const __m128i twos_count =
        _mm_add_epi8(_mm_shuffle_epi8(table, _mm_and_si128(twos, low)),
                     _mm_shuffle_epi8(table, _mm_and_si128(_mm_srli_epi16(twos, 4), low)));
    return _mm_add_epi8(ones_count, _mm_add_epi8(twos_count, twos_count));
}

static inline void lanes_cost(const struct match_features *left, int x,
                              const struct match_features *right, int right_index, int count,
                              uint8_t *cost) {
    const __m128i left0 = _mm_set1_epi8((char)left->census[0][x]);
    const __m128i left1 = _mm_set1_epi8((char)left->census[1][x]);
    const __m128i left2 = _mm_set1_epi8((char)left->census[2][x]);
    const __m128i gradient = _mm_set1_epi8((char)left->gradient[x]);
    const __m128i truncation = _mm_set1_epi8(MATCH_GRADIENT_TRUNCATION);
    for (int i = 0; i < count; i += 16) {
        const int at = right_index + i;
        const __m128i bits = weighted_bits16(_mm_xor_si128(left0, load16(right->census[0] + at)),
                                             _mm_xor_si128(left1, load16(right->census[1] + at)),
                                             _mm_xor_si128(left2, load16(right->census[2] + at)));
        const __m128i other = load16(right->gradient + at);
        const __m128i step =
            _mm_or_si128(_mm_subs_epu8(gradient, other), _mm_subs_epu8(other, gradient));
        store16(cost + i, _mm_add_epi8(bits, _mm_min_epu8(step, truncation)));
    }
}

static inline void lanes_blend(const uint8_t *a, const uint8_t *b, int wa, int count,
                               uint8_t *result) {
    INVARIANT(wa > 0 && wa < MATCH_WEIGHT_ONE);
    const __m128i weights = _mm_set1_epi16((short)(wa | (MATCH_WEIGHT_ONE - wa) << 8));
    const __m128i half = _mm_set1_epi16(MATCH_WEIGHT_ONE / 2);
    for (int i = 0; i < count; i += 16) {
        const __m128i first = load16(a + i);
        const __m128i second = load16(b + i);
        const __m128i low = _mm_maddubs_epi16(_mm_unpacklo_epi8(first, second), weights);
        const __m128i high = _mm_maddubs_epi16(_mm_unpackhi_epi8(first, second), weights);
        store16(result + i, _mm_packus_epi16(_mm_srli_epi16(_mm_add_epi16(low, half), 7),
                                             _mm_srli_epi16(_mm_add_epi16(high, half), 7)));
    }
}

static inline void lanes_blend_leaning(const uint8_t *a, const uint8_t *b, int wa, int count,
                                       uint8_t *result) {
    INVARIANT(wa > 0 && wa < MATCH_WEIGHT_ONE);
    const __m128i weights = _mm_set1_epi16((short)(wa | (MATCH_WEIGHT_ONE - wa) << 8));
    const __m128i half = _mm_set1_epi16(MATCH_WEIGHT_ONE / 2);
    const __m128i lean = _mm_set1_epi8(MATCH_LEAN);
    const __m128i infinite = _mm_set1_epi8(-1);
    __m128i before = infinite;
    __m128i here = load16(a);
    for (int i = 0; i < count; i += 16) {
        const __m128i after = i + 16 < count ? load16(a + i + 16) : infinite;
        const __m128i up = _mm_alignr_epi8(here, before, 15);
        const __m128i down = _mm_alignr_epi8(after, here, 1);
        const __m128i first = _mm_min_epu8(here, _mm_adds_epu8(_mm_min_epu8(up, down), lean));
        const __m128i second = load16(b + i);
        const __m128i low = _mm_maddubs_epi16(_mm_unpacklo_epi8(first, second), weights);
        const __m128i high = _mm_maddubs_epi16(_mm_unpackhi_epi8(first, second), weights);
        store16(result + i, _mm_packus_epi16(_mm_srli_epi16(_mm_add_epi16(low, half), 7),
                                             _mm_srli_epi16(_mm_add_epi16(high, half), 7)));
        before = here;
        here = after;
    }
}

static inline int lanes_message(const uint8_t *cost, const uint8_t *previous, int lowest,
                                struct match_penalties penalties, int count, uint8_t *message) {
    INVARIANT(lowest <= MATCH_COST_MAX && penalties.large <= MATCH_PENALTY_MAX);
    const __m128i base = _mm_set1_epi8((char)lowest);
    const __m128i small = _mm_set1_epi8((char)penalties.small);
    const __m128i large = _mm_set1_epi8((char)penalties.large);
    const __m128i cap = _mm_add_epi8(base, large);
    const __m128i infinite = _mm_set1_epi8(-1);
    __m128i before = infinite;
    __m128i here = load16(previous);
    __m128i smallest = infinite;
    for (int i = 0; i < count; i += 16) {
        const __m128i after = i + 16 < count ? load16(previous + i + 16) : infinite;
        const __m128i neighbours =
            _mm_min_epu8(_mm_alignr_epi8(here, before, 15), _mm_alignr_epi8(after, here, 1));
        const __m128i same = _mm_sub_epi8(_mm_min_epu8(here, cap), base);
        const __m128i beside =
            _mm_add_epi8(_mm_sub_epi8(_mm_min_epu8(neighbours, cap), base), small);
        const __m128i value =
            _mm_add_epi8(load16(cost + i), _mm_min_epu8(_mm_min_epu8(beside, same), large));
        store16(message + i, value);
        smallest = _mm_min_epu8(smallest, value);
        before = here;
        here = after;
    }
    return lowest16(smallest);
}

static inline int lanes_lowest(const uint8_t *values, int count) {
    __m128i smallest = load16(values);
    for (int i = 16; i < count; i += 16) {
        smallest = _mm_min_epu8(smallest, load16(values + i));
    }
    return lowest16(smallest);
}

// Sums of 8 lanes; those outside [begin, end) become UINT16_MAX.
static inline __m128i masked_sum8(const uint8_t *a, const uint8_t *b, const uint8_t *c,
                                  __m128i index, __m128i begin, __m128i end) {
    const __m128i sum = _mm_add_epi16(
        _mm_add_epi16(_mm_cvtepu8_epi16(_mm_loadl_epi64((const __m128i *)(const void *)a)),
                      _mm_cvtepu8_epi16(_mm_loadl_epi64((const __m128i *)(const void *)b))),
        _mm_cvtepu8_epi16(_mm_loadl_epi64((const __m128i *)(const void *)c)));
    const __m128i outside =
        _mm_or_si128(_mm_cmpgt_epi16(begin, index),
                     _mm_cmpgt_epi16(index, _mm_sub_epi16(end, _mm_set1_epi16(1))));
    return _mm_or_si128(sum, outside);
}

static inline struct match_winner lanes_winner(const uint8_t *a, const uint8_t *b, const uint8_t *c,
                                               int count, int begin, int end, uint16_t *sum) {
    INVARIANT(begin >= 0 && begin < end && end <= count);
    const __m128i first = _mm_set1_epi16((short)begin);
    const __m128i beyond = _mm_set1_epi16((short)end);
    const __m128i eight = _mm_set1_epi16(8);
    __m128i index = _mm_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7);
    __m128i lowest = _mm_set1_epi16(-1);
    for (int i = 0; i < count; i += 8) {
        const __m128i value = masked_sum8(a + i, b + i, c + i, index, first, beyond);
        store16(sum + i, value);
        lowest = _mm_min_epu16(lowest, value);
        index = _mm_add_epi16(index, eight);
    }
    struct match_winner result = {.index = 0};
    result.lowest = (uint16_t)_mm_cvtsi128_si32(_mm_minpos_epu16(lowest));
    const __m128i target = _mm_set1_epi16((short)result.lowest);
    int equal = 0;
    for (int i = 0; equal == 0; i += 8) {
        equal = _mm_movemask_epi8(_mm_cmpeq_epi16(load16(sum + i), target));
        result.index = i + (equal != 0 ? __builtin_ctz((unsigned)equal) / 2 : 0);
    }
    const __m128i below = _mm_set1_epi16((short)(result.index - 2));
    const __m128i above = _mm_set1_epi16((short)(result.index + 2));
    __m128i rival = _mm_set1_epi16(-1);
    index = _mm_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7);
    for (int i = 0; i < count; i += 8) {
        const __m128i beside =
            _mm_and_si128(_mm_cmpgt_epi16(index, below), _mm_cmpgt_epi16(above, index));
        rival = _mm_min_epu16(rival, _mm_or_si128(load16(sum + i), beside));
        index = _mm_add_epi16(index, eight);
    }
    result.rival = (uint16_t)_mm_cvtsi128_si32(_mm_minpos_epu16(rival));
    return result;
}

#endif

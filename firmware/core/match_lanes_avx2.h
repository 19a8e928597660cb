// SPDX-License-Identifier: Apache-2.0
/// The operations of match_lanes_plain.h with AVX2, 32 lanes at a time and a rest of 16: the
/// same bytes.
#ifndef VERGENCE_CORE_MATCH_LANES_AVX2_H
#define VERGENCE_CORE_MATCH_LANES_AVX2_H

#include <immintrin.h>
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
static inline __m256i load32(const void *from) {
    return _mm256_loadu_si256((const __m256i *)from);
}
static inline void store32(void *to, __m256i value) {
    _mm256_storeu_si256((__m256i *)to, value);
}

// 16 lanes in the lower half; the upper half is `fill`.
static inline __m256i load16_filled(const void *from, __m256i fill) {
    return _mm256_inserti128_si256(fill, load16(from), 0);
}

static inline __m256i load_lanes(const uint8_t *from, int i, int count, __m256i fill) {
    return i + 32 <= count ? load32(from + i) : load16_filled(from + i, fill);
}

static inline void store_lanes(uint8_t *to, int i, int count, __m256i value) {
    if (i + 32 <= count) {
        store32(to + i, value);
    } else {
        store16(to + i, _mm256_castsi256_si128(value));
    }
}

static inline int lowest32(__m256i value) {
    const __m128i half =
        _mm_min_epu8(_mm256_castsi256_si128(value), _mm256_extracti128_si256(value, 1));
    const __m128i pairs = _mm_min_epu8(half, _mm_srli_epi16(half, 8));
    const __m128i bytes = _mm_and_si128(pairs, _mm_set1_epi16(0xff));
    return _mm_cvtsi128_si32(_mm_minpos_epu16(bytes)) & 0xff;
}

static inline uint16_t lowest16_u16(__m256i value) {
    const __m128i half =
        _mm_min_epu16(_mm256_castsi256_si128(value), _mm256_extracti128_si256(value, 1));
    return (uint16_t)_mm_cvtsi128_si32(_mm_minpos_epu16(half));
}

// MATCH_CENSUS_WEIGHT times the bits set in three bytes: a carry-save adder, then table lookups by
// nibble that hold the weighted counts.
static inline __m256i weighted_bits32(__m256i a, __m256i b, __m256i c) {
    const __m256i low = _mm256_set1_epi8(0x0f);
    const __m256i table = _mm256_broadcastsi128_si256(
        _mm_setr_epi8(0, 4, 4, 8, 4, 8, 8, 12, 4, 8, 8, 12, 8, 12, 12, 16));
    const __m256i half = _mm256_xor_si256(a, b);
    const __m256i ones = _mm256_xor_si256(half, c);
    const __m256i twos = _mm256_or_si256(_mm256_and_si256(a, b), _mm256_and_si256(half, c));
    const __m256i ones_count = _mm256_add_epi8(
        _mm256_shuffle_epi8(table, _mm256_and_si256(ones, low)),
        _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(ones, 4), low)));
    const __m256i twos_count = _mm256_add_epi8(
        _mm256_shuffle_epi8(table, _mm256_and_si256(twos, low)),
        _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(twos, 4), low)));
    return _mm256_add_epi8(ones_count, _mm256_add_epi8(twos_count, twos_count));
}

static inline void lanes_cost(const struct match_features *left, int x,
                              const struct match_features *right, int right_index, int count,
                              uint8_t *cost) {
    const __m256i left0 = _mm256_set1_epi8((char)left->census[0][x]);
    const __m256i left1 = _mm256_set1_epi8((char)left->census[1][x]);
    const __m256i left2 = _mm256_set1_epi8((char)left->census[2][x]);
    const __m256i gradient = _mm256_set1_epi8((char)left->gradient[x]);
    const __m256i truncation = _mm256_set1_epi8(MATCH_GRADIENT_TRUNCATION);
    const __m256i zero = _mm256_setzero_si256();
    const uint8_t *right0 = right->census[0] + right_index;
    const uint8_t *right1 = right->census[1] + right_index;
    const uint8_t *right2 = right->census[2] + right_index;
    const uint8_t *right_gradient = right->gradient + right_index;
    for (int i = 0; i < count; i += 32) {
        const __m256i bits =
            weighted_bits32(_mm256_xor_si256(left0, load_lanes(right0, i, count, zero)),
                            _mm256_xor_si256(left1, load_lanes(right1, i, count, zero)),
                            _mm256_xor_si256(left2, load_lanes(right2, i, count, zero)));
        const __m256i other = load_lanes(right_gradient, i, count, zero);
        const __m256i step =
            _mm256_or_si256(_mm256_subs_epu8(gradient, other), _mm256_subs_epu8(other, gradient));
        store_lanes(cost, i, count, _mm256_add_epi8(bits, _mm256_min_epu8(step, truncation)));
    }
}

static inline void lanes_blend(const uint8_t *a, const uint8_t *b, int wa, int count,
                               uint8_t *result) {
    INVARIANT(wa > 0 && wa < MATCH_WEIGHT_ONE);
    const __m256i weights = _mm256_set1_epi16((short)(wa | (MATCH_WEIGHT_ONE - wa) << 8));
    const __m256i half = _mm256_set1_epi16(MATCH_WEIGHT_ONE / 2);
    const __m256i zero = _mm256_setzero_si256();
    for (int i = 0; i < count; i += 32) {
        const __m256i first = load_lanes(a, i, count, zero);
        const __m256i second = load_lanes(b, i, count, zero);
        const __m256i low = _mm256_maddubs_epi16(_mm256_unpacklo_epi8(first, second), weights);
        const __m256i high = _mm256_maddubs_epi16(_mm256_unpackhi_epi8(first, second), weights);
        store_lanes(result, i, count,
                    _mm256_packus_epi16(_mm256_srli_epi16(_mm256_add_epi16(low, half), 7),
                                        _mm256_srli_epi16(_mm256_add_epi16(high, half), 7)));
    }
}

static inline void lanes_blend_leaning(const uint8_t *a, const uint8_t *b, int wa, int count,
                                       uint8_t *result) {
    INVARIANT(wa > 0 && wa < MATCH_WEIGHT_ONE);
    const __m256i weights = _mm256_set1_epi16((short)(wa | (MATCH_WEIGHT_ONE - wa) << 8));
    const __m256i half = _mm256_set1_epi16(MATCH_WEIGHT_ONE / 2);
    const __m256i lean = _mm256_set1_epi8(MATCH_LEAN);
    const __m256i infinite = _mm256_set1_epi8(-1);
    __m256i before = infinite;
    __m256i here = load_lanes(a, 0, count, infinite);
    for (int i = 0; i < count; i += 32) {
        const __m256i after = i + 32 < count ? load_lanes(a, i + 32, count, infinite) : infinite;
        const __m256i up =
            _mm256_alignr_epi8(here, _mm256_permute2x128_si256(before, here, 0x21), 15);
        const __m256i down =
            _mm256_alignr_epi8(_mm256_permute2x128_si256(here, after, 0x21), here, 1);
        const __m256i first =
            _mm256_min_epu8(here, _mm256_adds_epu8(_mm256_min_epu8(up, down), lean));
        const __m256i second = load_lanes(b, i, count, infinite);
        const __m256i low = _mm256_maddubs_epi16(_mm256_unpacklo_epi8(first, second), weights);
        const __m256i high = _mm256_maddubs_epi16(_mm256_unpackhi_epi8(first, second), weights);
        store_lanes(result, i, count,
                    _mm256_packus_epi16(_mm256_srli_epi16(_mm256_add_epi16(low, half), 7),
                                        _mm256_srli_epi16(_mm256_add_epi16(high, half), 7)));
        before = here;
        here = after;
    }
}

static inline int lanes_message(const uint8_t *cost, const uint8_t *previous, int lowest,
                                struct match_penalties penalties, int count, uint8_t *message) {
    INVARIANT(lowest <= MATCH_COST_MAX && penalties.large <= MATCH_PENALTY_MAX);
    const __m256i base = _mm256_set1_epi8((char)lowest);
    const __m256i small = _mm256_set1_epi8((char)penalties.small);
    const __m256i large = _mm256_set1_epi8((char)penalties.large);
    const __m256i cap = _mm256_add_epi8(base, large);
    const __m256i infinite = _mm256_set1_epi8(-1);
    __m256i before = infinite;
    __m256i here = load_lanes(previous, 0, count, infinite);
    __m256i smallest = infinite;
    for (int i = 0; i < count; i += 32) {
        const __m256i after =
            i + 32 < count ? load_lanes(previous, i + 32, count, infinite) : infinite;
        const __m256i up =
            _mm256_alignr_epi8(here, _mm256_permute2x128_si256(before, here, 0x21), 15);
        const __m256i down =
            _mm256_alignr_epi8(_mm256_permute2x128_si256(here, after, 0x21), here, 1);
        const __m256i same = _mm256_sub_epi8(_mm256_min_epu8(here, cap), base);
        const __m256i beside = _mm256_add_epi8(
            _mm256_sub_epi8(_mm256_min_epu8(_mm256_min_epu8(up, down), cap), base), small);
        const __m256i step = _mm256_min_epu8(_mm256_min_epu8(beside, same), large);
        const __m256i value = _mm256_add_epi8(load_lanes(cost, i, count, infinite), step);
        store_lanes(message, i, count, value);
        // The filling of a rest of 16 must not win.
        smallest = _mm256_min_epu8(
            smallest, i + 32 <= count
                          ? value
                          : _mm256_inserti128_si256(infinite, _mm256_castsi256_si128(value), 0));
        before = here;
        here = after;
    }
    return lowest32(smallest);
}

static inline int lanes_lowest(const uint8_t *values, int count) {
    const __m256i infinite = _mm256_set1_epi8(-1);
    __m256i smallest = infinite;
    for (int i = 0; i < count; i += 32) {
        smallest = _mm256_min_epu8(smallest, load_lanes(values, i, count, infinite));
    }
    return lowest32(smallest);
}

static inline __m256i sum_of_16(const uint8_t *a, const uint8_t *b, const uint8_t *c) {
    return _mm256_add_epi16(
        _mm256_add_epi16(_mm256_cvtepu8_epi16(load16(a)), _mm256_cvtepu8_epi16(load16(b))),
        _mm256_cvtepu8_epi16(load16(c)));
}

static inline __m256i first_indices(void) {
    return _mm256_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}

static inline struct match_winner lanes_winner(const uint8_t *a, const uint8_t *b, const uint8_t *c,
                                               int count, int begin, int end, uint16_t *sum) {
    INVARIANT(begin >= 0 && begin < end && end <= count);
    const __m256i sixteen = _mm256_set1_epi16(16);
    __m256i lowest = _mm256_set1_epi16(-1);
    if (begin == 0 && end == count) {
        for (int i = 0; i < count; i += 16) {
            const __m256i value = sum_of_16(a + i, b + i, c + i);
            store32(sum + i, value);
            lowest = _mm256_min_epu16(lowest, value);
        }
    } else {
        const __m256i first = _mm256_set1_epi16((short)begin);
        const __m256i last = _mm256_set1_epi16((short)(end - 1));
        __m256i index = first_indices();
        for (int i = 0; i < count; i += 16) {
            const __m256i outside =
                _mm256_or_si256(_mm256_cmpgt_epi16(first, index), _mm256_cmpgt_epi16(index, last));
            const __m256i value = _mm256_or_si256(sum_of_16(a + i, b + i, c + i), outside);
            store32(sum + i, value);
            lowest = _mm256_min_epu16(lowest, value);
            index = _mm256_add_epi16(index, sixteen);
        }
    }
    struct match_winner result = {.lowest = lowest16_u16(lowest)};
    const __m256i target = _mm256_set1_epi16((short)result.lowest);
    unsigned equal = 0;
    for (int i = 0; equal == 0; i += 16) {
        equal = (unsigned)_mm256_movemask_epi8(_mm256_cmpeq_epi16(load32(sum + i), target));
        result.index = i + (equal != 0 ? __builtin_ctz(equal) / 2 : 0);
    }
    const __m256i below = _mm256_set1_epi16((short)(result.index - 2));
    const __m256i above = _mm256_set1_epi16((short)(result.index + 2));
    __m256i rival = _mm256_set1_epi16(-1);
    __m256i index = first_indices();
    for (int i = 0; i < count; i += 16) {
        const __m256i beside =
            _mm256_and_si256(_mm256_cmpgt_epi16(index, below), _mm256_cmpgt_epi16(above, index));
        rival = _mm256_min_epu16(rival, _mm256_or_si256(load32(sum + i), beside));
        index = _mm256_add_epi16(index, sixteen);
    }
    result.rival = lowest16_u16(rival);
    return result;
}

#endif

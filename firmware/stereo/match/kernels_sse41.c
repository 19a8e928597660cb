// SPDX-License-Identifier: Apache-2.0
// For x86 processors with SSE4.1: one member per vector.
// The operations are those of vector_plain.h.
#if defined(__x86_64__)

#include <smmintrin.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/match/state.h"

#define VECTOR_NAME "sse41"
#define VECTOR_KERNELS match_sse41_kernels

enum {
    VECTOR_MEMBERS = 1,
    VECTOR_LANES_UNROLLED = 64,  // most lanes whose loops are unrolled
};

struct vector {
    __m128i lanes;
};

struct vector_shares {
    __m128i pairs;
};

static inline struct vector vector_load(const uint8_t *const at[], ptrdiff_t offset) {
    return (struct vector){_mm_loadu_si128((const __m128i *)(at[0] + offset))};
}

static inline void vector_store(uint8_t *const at[], ptrdiff_t offset, struct vector value) {
    _mm_storeu_si128((__m128i *)(at[0] + offset), value.lanes);
}

static inline struct vector vector_each(const uint8_t *const at[], ptrdiff_t offset) {
    return (struct vector){_mm_set1_epi8((char)at[0][offset])};
}

static inline struct vector vector_all(uint8_t value) {
    return (struct vector){_mm_set1_epi8((char)value)};
}

static inline struct vector_shares vector_shares_each(const match_share *const at[],
                                                      ptrdiff_t offset) {
    return (struct vector_shares){_mm_set1_epi16((short)at[0][offset])};
}

static inline struct vector vector_min(struct vector a, struct vector b) {
    return (struct vector){_mm_min_epu8(a.lanes, b.lanes)};
}

static inline struct vector vector_add(struct vector a, struct vector b) {
    return (struct vector){_mm_adds_epu8(a.lanes, b.lanes)};
}

static inline struct vector vector_sub(struct vector a, struct vector b) {
    return (struct vector){_mm_subs_epu8(a.lanes, b.lanes)};
}

static inline struct vector vector_or(struct vector a, struct vector b) {
    return (struct vector){_mm_or_si128(a.lanes, b.lanes)};
}

static inline struct vector vector_up(struct vector here, struct vector before) {
    return (struct vector){_mm_alignr_epi8(here.lanes, before.lanes, MATCH_LANES - 1)};
}

static inline struct vector vector_down(struct vector here, struct vector after) {
    return (struct vector){_mm_alignr_epi8(after.lanes, here.lanes, 1)};
}

static inline struct vector vector_blend(struct vector a, struct vector b,
                                         struct vector_shares shares) {
    // A rounded division by 128 is the rounded high part of a product with 256.
    const __m128i scale = _mm_set1_epi16(256);
    const __m128i low = _mm_maddubs_epi16(_mm_unpacklo_epi8(a.lanes, b.lanes), shares.pairs);
    const __m128i high = _mm_maddubs_epi16(_mm_unpackhi_epi8(a.lanes, b.lanes), shares.pairs);
    return (struct vector){
        _mm_packus_epi16(_mm_mulhrs_epi16(low, scale), _mm_mulhrs_epi16(high, scale))};
}

static inline struct vector vector_lowest(struct vector value) {
    // The lower one of each two lanes, in 16 bits; minpos brings the lowest of these to the front.
    const __m128i lower = _mm_min_epu8(value.lanes, _mm_srli_epi16(value.lanes, 8));
    return (struct vector){_mm_shuffle_epi8(_mm_minpos_epu16(lower), _mm_setzero_si128())};
}

static inline uint8_t vector_first(struct vector value, int member) {
    (void)member;
    return (uint8_t)_mm_cvtsi128_si32(value.lanes);
}

static inline uint32_t vector_equal(struct vector a, struct vector b) {
    return (uint32_t)_mm_movemask_epi8(_mm_cmpeq_epi8(a.lanes, b.lanes));
}

// The table holds the weighted counts of a nibble.
static inline __m128i weighted_bits(__m128i value) {
    enum {
        ONE = TUNE_CENSUS_WEIGHT,
        TWO = 2 * TUNE_CENSUS_WEIGHT,
        THREE = 3 * TUNE_CENSUS_WEIGHT,
        FOUR = 4 * TUNE_CENSUS_WEIGHT,
    };
    const __m128i table = _mm_setr_epi8(0, ONE, ONE, TWO, ONE, TWO, TWO, THREE, ONE, TWO, TWO,
                                        THREE, TWO, THREE, THREE, FOUR);
    const __m128i nibble = _mm_set1_epi8(0x0f);
    return _mm_add_epi8(_mm_shuffle_epi8(table, _mm_and_si128(value, nibble)),
                        _mm_shuffle_epi8(table, _mm_and_si128(_mm_srli_epi16(value, 4), nibble)));
}

static inline struct vector vector_cost(const struct vector left[MATCH_CENSUS_PLANES + 1],
                                        const struct vector right[MATCH_CENSUS_PLANES + 1]) {
    const __m128i a = _mm_xor_si128(left[0].lanes, right[0].lanes);
    const __m128i b = _mm_xor_si128(left[1].lanes, right[1].lanes);
    const __m128i c = _mm_xor_si128(left[2].lanes, right[2].lanes);
    // A carry-save adder first, so that two counts serve three bytes.
    const __m128i half = _mm_xor_si128(a, b);
    const __m128i ones = weighted_bits(_mm_xor_si128(half, c));
    const __m128i twos = weighted_bits(_mm_or_si128(_mm_and_si128(a, b), _mm_and_si128(half, c)));
    const __m128i bits = _mm_add_epi8(ones, _mm_add_epi8(twos, twos));
    const __m128i step = _mm_or_si128(_mm_subs_epu8(left[3].lanes, right[3].lanes),
                                      _mm_subs_epu8(right[3].lanes, left[3].lanes));
    return (struct vector){
        _mm_add_epi8(bits, _mm_min_epu8(step, _mm_set1_epi8(TUNE_GRADIENT_MAX)))};
}

// The steps use the vectors defined above.
#include "stereo/match/kernels_text.h"

#endif

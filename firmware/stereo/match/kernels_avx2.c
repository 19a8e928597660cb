// SPDX-License-Identifier: Apache-2.0
// For x86 processors with AVX2: two members per vector.
// The operations are those of vector_plain.h.
#if defined(__x86_64__)

#include <immintrin.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/match/state.h"

#define VECTOR_NAME "avx2"
#define VECTOR_KERNELS match_avx2_kernels

enum {
    VECTOR_MEMBERS = 2,
    VECTOR_LANES_UNROLLED = 64,  // most lanes whose loops are unrolled
};

struct vector {
    __m256i both;
};

struct vector_shares {
    __m256i pairs;
};

static inline __m128i load16(const uint8_t *from) {
    return _mm_loadu_si128((const __m128i *)from);
}

static inline struct vector vector_load(const uint8_t *const at[], ptrdiff_t offset) {
    return (struct vector){_mm256_inserti128_si256(_mm256_castsi128_si256(load16(at[0] + offset)),
                                                   load16(at[1] + offset), 1)};
}

static inline void vector_store(uint8_t *const at[], ptrdiff_t offset, struct vector value) {
    _mm_storeu_si128((__m128i *)(at[0] + offset), _mm256_castsi256_si128(value.both));
    _mm_storeu_si128((__m128i *)(at[1] + offset), _mm256_extracti128_si256(value.both, 1));
}

static inline struct vector vector_each(const uint8_t *const at[], ptrdiff_t offset) {
    return (struct vector){
        _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_set1_epi8((char)at[0][offset])),
                                _mm_set1_epi8((char)at[1][offset]), 1)};
}

static inline struct vector vector_all(uint8_t value) {
    return (struct vector){_mm256_set1_epi8((char)value)};
}

static inline struct vector_shares vector_shares_each(const match_share *const at[],
                                                      ptrdiff_t offset) {
    return (struct vector_shares){
        _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_set1_epi16((short)at[0][offset])),
                                _mm_set1_epi16((short)at[1][offset]), 1)};
}

static inline struct vector vector_min(struct vector a, struct vector b) {
    return (struct vector){_mm256_min_epu8(a.both, b.both)};
}

static inline struct vector vector_add(struct vector a, struct vector b) {
    return (struct vector){_mm256_adds_epu8(a.both, b.both)};
}

static inline struct vector vector_sub(struct vector a, struct vector b) {
    return (struct vector){_mm256_subs_epu8(a.both, b.both)};
}

static inline struct vector vector_or(struct vector a, struct vector b) {
    return (struct vector){_mm256_or_si256(a.both, b.both)};
}

static inline struct vector vector_up(struct vector here, struct vector before) {
    return (struct vector){_mm256_alignr_epi8(here.both, before.both, MATCH_LANES - 1)};
}

static inline struct vector vector_down(struct vector here, struct vector after) {
    return (struct vector){_mm256_alignr_epi8(after.both, here.both, 1)};
}

static inline struct vector vector_blend(struct vector a, struct vector b,
                                         struct vector_shares shares) {
    // A rounded division by 128 is the rounded high part of a product with 256.
    const __m256i scale = _mm256_set1_epi16(256);
    const __m256i low = _mm256_maddubs_epi16(_mm256_unpacklo_epi8(a.both, b.both), shares.pairs);
    const __m256i high = _mm256_maddubs_epi16(_mm256_unpackhi_epi8(a.both, b.both), shares.pairs);
    return (struct vector){
        _mm256_packus_epi16(_mm256_mulhrs_epi16(low, scale), _mm256_mulhrs_epi16(high, scale))};
}

static inline struct vector vector_lowest(struct vector value) {
    __m256i lowest = value.both;
    lowest = _mm256_min_epu8(lowest, _mm256_shuffle_epi32(lowest, 0x4e));
    lowest = _mm256_min_epu8(lowest, _mm256_shuffle_epi32(lowest, 0xb1));
    lowest = _mm256_min_epu8(lowest, _mm256_alignr_epi8(lowest, lowest, 2));
    return (struct vector){_mm256_min_epu8(lowest, _mm256_alignr_epi8(lowest, lowest, 1))};
}

static inline uint8_t vector_first(struct vector value, int member) {
    return (uint8_t)_mm_cvtsi128_si32(member == 0 ? _mm256_castsi256_si128(value.both)
                                                  : _mm256_extracti128_si256(value.both, 1));
}

static inline uint32_t vector_equal(struct vector a, struct vector b) {
    return (uint32_t)_mm256_movemask_epi8(_mm256_cmpeq_epi8(a.both, b.both));
}

// The table holds the weighted counts of a nibble.
static inline __m256i weighted_bits(__m256i value) {
    enum {
        ONE = TUNE_CENSUS_WEIGHT,
        TWO = 2 * TUNE_CENSUS_WEIGHT,
        THREE = 3 * TUNE_CENSUS_WEIGHT,
        FOUR = 4 * TUNE_CENSUS_WEIGHT,
    };
    const __m256i table = _mm256_broadcastsi128_si256(_mm_setr_epi8(
        0, ONE, ONE, TWO, ONE, TWO, TWO, THREE, ONE, TWO, TWO, THREE, TWO, THREE, THREE, FOUR));
    const __m256i low = _mm256_set1_epi8(0x0f);
    return _mm256_add_epi8(
        _mm256_shuffle_epi8(table, _mm256_and_si256(value, low)),
        _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(value, 4), low)));
}

static inline struct vector vector_cost(const struct vector left[MATCH_CENSUS_PLANES + 1],
                                        const struct vector right[MATCH_CENSUS_PLANES + 1]) {
    const __m256i a = _mm256_xor_si256(left[0].both, right[0].both);
    const __m256i b = _mm256_xor_si256(left[1].both, right[1].both);
    const __m256i c = _mm256_xor_si256(left[2].both, right[2].both);
    const __m256i half = _mm256_xor_si256(a, b);
    const __m256i ones = weighted_bits(_mm256_xor_si256(half, c));
    const __m256i twos =
        weighted_bits(_mm256_or_si256(_mm256_and_si256(a, b), _mm256_and_si256(half, c)));
    const __m256i bits = _mm256_add_epi8(ones, _mm256_add_epi8(twos, twos));
    const __m256i step = _mm256_or_si256(_mm256_subs_epu8(left[3].both, right[3].both),
                                         _mm256_subs_epu8(right[3].both, left[3].both));
    return (struct vector){
        _mm256_add_epi8(bits, _mm256_min_epu8(step, _mm256_set1_epi8(TUNE_GRADIENT_MAX)))};
}

// The steps use the vectors defined above.
#include "stereo/match/kernels_text.h"

#endif

// SPDX-License-Identifier: Apache-2.0
// For ARM processors with NEON, all 64-bit ones and 32-bit ones if compiled for them: one member
// per vector. Independent of the byte order in memory.
// The operations are those of vector_plain.h.
#if defined(__ARM_NEON)

#include <arm_neon.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/match/state.h"

#define VECTOR_NAME "neon"
#define VECTOR_KERNELS match_neon_kernels

enum {
    VECTOR_MEMBERS = 1,
    VECTOR_LANES_UNROLLED = 64,  // most lanes whose loops are unrolled
};

struct vector {
    uint8x16_t lanes;
};

struct vector_shares {
    uint8x16_t first, second;
};

static inline struct vector vector_load(const uint8_t *const at[], ptrdiff_t offset) {
    return (struct vector){vld1q_u8(at[0] + offset)};
}

static inline void vector_store(uint8_t *const at[], ptrdiff_t offset, struct vector value) {
    vst1q_u8(at[0] + offset, value.lanes);
}

static inline struct vector vector_each(const uint8_t *const at[], ptrdiff_t offset) {
    return (struct vector){vld1q_dup_u8(at[0] + offset)};
}

static inline struct vector vector_all(uint8_t value) {
    return (struct vector){vdupq_n_u8(value)};
}

static inline struct vector_shares vector_shares_each(const match_share *const at[],
                                                      ptrdiff_t offset) {
    const uint16x8_t pairs = vld1q_dup_u16(at[0] + offset);
    const uint8x8_t first = vmovn_u16(pairs);
    const uint8x8_t second = vshrn_n_u16(pairs, 8);
    return (struct vector_shares){vcombine_u8(first, first), vcombine_u8(second, second)};
}

static inline struct vector vector_min(struct vector a, struct vector b) {
    return (struct vector){vminq_u8(a.lanes, b.lanes)};
}

static inline struct vector vector_add(struct vector a, struct vector b) {
    return (struct vector){vqaddq_u8(a.lanes, b.lanes)};
}

static inline struct vector vector_sub(struct vector a, struct vector b) {
    return (struct vector){vqsubq_u8(a.lanes, b.lanes)};
}

static inline struct vector vector_or(struct vector a, struct vector b) {
    return (struct vector){vorrq_u8(a.lanes, b.lanes)};
}

static inline struct vector vector_up(struct vector here, struct vector before) {
    return (struct vector){vextq_u8(before.lanes, here.lanes, MATCH_LANES - 1)};
}

static inline struct vector vector_down(struct vector here, struct vector after) {
    return (struct vector){vextq_u8(here.lanes, after.lanes, 1)};
}

static inline struct vector vector_blend(struct vector a, struct vector b,
                                         struct vector_shares shares) {
    const uint16x8_t low = vmlal_u8(vmull_u8(vget_low_u8(a.lanes), vget_low_u8(shares.first)),
                                    vget_low_u8(b.lanes), vget_low_u8(shares.second));
    const uint16x8_t high = vmlal_u8(vmull_u8(vget_high_u8(a.lanes), vget_high_u8(shares.first)),
                                     vget_high_u8(b.lanes), vget_high_u8(shares.second));
    // A rounded division by 128.
    return (struct vector){vcombine_u8(vrshrn_n_u16(low, 7), vrshrn_n_u16(high, 7))};
}

static inline struct vector vector_lowest(struct vector value) {
#if defined(__aarch64__)
    return (struct vector){vdupq_n_u8(vminvq_u8(value.lanes))};
#else
    // Each step halves the remaining lanes and repeats them: at the end all eight lanes hold the
    // lowest.
    uint8x8_t lowest = vpmin_u8(vget_low_u8(value.lanes), vget_high_u8(value.lanes));
    lowest = vpmin_u8(lowest, lowest);
    lowest = vpmin_u8(lowest, lowest);
    lowest = vpmin_u8(lowest, lowest);
    return (struct vector){vcombine_u8(lowest, lowest)};
#endif
}

static inline uint8_t vector_first(struct vector value, int member) {
    (void)member;
    return vgetq_lane_u8(value.lanes, 0);
}

static inline uint32_t vector_equal(struct vector a, struct vector b) {
    static const uint8_t bit_of_lane[MATCH_LANES / 2] = {1, 2, 4, 8, 16, 32, 64, 128};
    const uint8x8_t weights = vld1_u8(bit_of_lane);
    const uint8x16_t bits = vandq_u8(vceqq_u8(a.lanes, b.lanes), vcombine_u8(weights, weights));
    // The sums of the lower and of the upper half end up in the first two lanes.
    uint8x8_t sums = vpadd_u8(vget_low_u8(bits), vget_high_u8(bits));
    sums = vpadd_u8(sums, sums);
    sums = vpadd_u8(sums, sums);
    return vget_lane_u8(sums, 0) | (uint32_t)vget_lane_u8(sums, 1) << 8;
}

static inline struct vector vector_cost(const struct vector left[MATCH_CENSUS_PLANES + 1],
                                        const struct vector right[MATCH_CENSUS_PLANES + 1]) {
    uint8x16_t differing = vcntq_u8(veorq_u8(left[0].lanes, right[0].lanes));
    for (int plane = 1; plane < MATCH_CENSUS_PLANES; plane++) {
        const uint8x16_t unlike = veorq_u8(left[plane].lanes, right[plane].lanes);
        differing = vaddq_u8(differing, vcntq_u8(unlike));
    }
    const uint8x16_t step =
        vabdq_u8(left[MATCH_CENSUS_PLANES].lanes, right[MATCH_CENSUS_PLANES].lanes);
    return (struct vector){vmlaq_u8(vminq_u8(step, vdupq_n_u8(TUNE_GRADIENT_MAX)), differing,
                                    vdupq_n_u8(TUNE_CENSUS_WEIGHT))};
}

// The steps use the vectors defined above.
#include "stereo/match/kernels_text.h"

#endif

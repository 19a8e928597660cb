// SPDX-License-Identifier: Apache-2.0
/// 16 disparities ("lanes") of one pixel at a time: the reference, in plain C written so that
/// compilers vectorize it. Those of kernels_*.c give the same results, some of them for
/// several pixels at a time: the pixels in a vector are its "members", each with 16 lanes and its
/// own pointer in the arrays `at`.
#ifndef VERGENCE_STEREO_MATCH_VECTOR_PLAIN_H
#define VERGENCE_STEREO_MATCH_VECTOR_PLAIN_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "stereo/match/state.h"
#if defined(__bfin__)
#include "stereo/bfin/bytes.h"
#include "stereo/bfin/cells.h"
#include "stereo/bfin/census.h"
#include "stereo/bfin/quotient.h"
// The passes over all lanes of a pixel are those of the cells; the rest is plain C.
#define VECTOR_HAS_CELLS
#endif

#define VECTOR_NAME "plain"
#define VECTOR_KERNELS match_plain_kernels

enum {
    VECTOR_MEMBERS = 1,
    VECTOR_LANES_UNROLLED = 32,  // most lanes whose loops are unrolled
};

struct vector {
    uint8_t lane[MATCH_LANES];
};

struct vector_shares {
    uint8_t first, second;
};

static inline uint8_t lower_u8(uint8_t a, uint8_t b) {
    return a < b ? a : b;
}

/// Loads 16 bytes of each member, from at[member] + offset.
static inline struct vector vector_load(const uint8_t *const at[], ptrdiff_t offset) {
    struct vector result;
    memcpy(result.lane, at[0] + offset, MATCH_LANES);
    return result;
}

static inline void vector_store(uint8_t *const at[], ptrdiff_t offset, struct vector value) {
    memcpy(at[0] + offset, value.lane, MATCH_LANES);
}

/// All lanes of a member are its byte at[member][offset].
static inline struct vector vector_each(const uint8_t *const at[], ptrdiff_t offset) {
    struct vector result;
    memset(result.lane, at[0][offset], MATCH_LANES);
    return result;
}

static inline struct vector vector_all(uint8_t value) {
    struct vector result;
    memset(result.lane, value, MATCH_LANES);
    return result;
}

static inline struct vector_shares vector_shares_each(const match_share *const at[],
                                                      ptrdiff_t offset) {
    const match_share pair = at[0][offset];
    return (struct vector_shares){(uint8_t)(pair & 0xff), (uint8_t)(pair >> 8)};
}

static inline struct vector vector_min(struct vector a, struct vector b) {
    struct vector result;
    for (int i = 0; i < MATCH_LANES; i++) {
        result.lane[i] = lower_u8(a.lane[i], b.lane[i]);
    }
    return result;
}

/// a + b, at most 255.
static inline struct vector vector_add(struct vector a, struct vector b) {
    struct vector result;
    for (int i = 0; i < MATCH_LANES; i++) {
        const uint8_t room = (uint8_t)(UINT8_MAX - b.lane[i]);
        result.lane[i] = (uint8_t)(lower_u8(a.lane[i], room) + b.lane[i]);
    }
    return result;
}

/// a - b, at least 0.
static inline struct vector vector_sub(struct vector a, struct vector b) {
    struct vector result;
    for (int i = 0; i < MATCH_LANES; i++) {
        result.lane[i] = (uint8_t)(a.lane[i] - lower_u8(a.lane[i], b.lane[i]));
    }
    return result;
}

static inline struct vector vector_or(struct vector a, struct vector b) {
    struct vector result;
    for (int i = 0; i < MATCH_LANES; i++) {
        result.lane[i] = (uint8_t)(a.lane[i] | b.lane[i]);
    }
    return result;
}

/// Each lane gets its lower neighbour; lane 0 the last one of `before`.
static inline struct vector vector_up(struct vector here, struct vector before) {
    struct vector result;
    result.lane[0] = before.lane[MATCH_LANES - 1];
    for (int i = 1; i < MATCH_LANES; i++) {
        result.lane[i] = here.lane[i - 1];
    }
    return result;
}

/// Each lane gets its upper neighbour; the last lane the first one of `after`.
static inline struct vector vector_down(struct vector here, struct vector after) {
    struct vector result;
    result.lane[MATCH_LANES - 1] = after.lane[0];
    for (int i = 0; i < MATCH_LANES - 1; i++) {
        result.lane[i] = here.lane[i + 1];
    }
    return result;
}

/// (a first + b second + half) / MATCH_WEIGHT_ONE.
static inline struct vector vector_blend(struct vector a, struct vector b,
                                         struct vector_shares shares) {
    struct vector result;
    for (int i = 0; i < MATCH_LANES; i++) {
        const uint16_t mixed =
            (uint16_t)(a.lane[i] * shares.first + b.lane[i] * shares.second + MATCH_WEIGHT_ONE / 2);
        result.lane[i] = (uint8_t)(mixed / MATCH_WEIGHT_ONE);
    }
    return result;
}

/// All lanes of a member are its lowest lane.
static inline struct vector vector_lowest(struct vector value) {
    uint8_t lowest = UINT8_MAX;
    for (int i = 0; i < MATCH_LANES; i++) {
        lowest = lower_u8(lowest, value.lane[i]);
    }
    return vector_all(lowest);
}

/// Lane 0 of a member.
static inline uint8_t vector_first(struct vector value, int member) {
    (void)member;
    return value.lane[0];
}

/// Bit 16 member + i is set if lane i of both is equal.
static inline uint32_t vector_equal(struct vector a, struct vector b) {
    uint32_t bits = 0;
    for (int i = 0; i < MATCH_LANES; i++) {
        bits |= (uint32_t)(a.lane[i] == b.lane[i]) << i;
    }
    return bits;
}

// Bits set in the three bytes together: a carry-save adder first, so that two byte counts serve
// three bytes.
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

/// TUNE_CENSUS_WEIGHT for each bit in which the census planes differ, plus the difference of the
/// gradients, at most TUNE_GRADIENT_MAX.
static inline struct vector vector_cost(const struct vector left[MATCH_CENSUS_PLANES + 1],
                                        const struct vector right[MATCH_CENSUS_PLANES + 1]) {
    struct vector result;
    for (int i = 0; i < MATCH_LANES; i++) {
        const uint8_t differing =
            count_bits(left[0].lane[i] ^ right[0].lane[i], left[1].lane[i] ^ right[1].lane[i],
                       left[2].lane[i] ^ right[2].lane[i]);
        const uint8_t a = left[3].lane[i];
        const uint8_t b = right[3].lane[i];
        const uint8_t step = a > b ? (uint8_t)(a - b) : (uint8_t)(b - a);
        result.lane[i] =
            (uint8_t)(TUNE_CENSUS_WEIGHT * differing + lower_u8(step, TUNE_GRADIENT_MAX));
    }
    return result;
}

#endif

// SPDX-License-Identifier: Apache-2.0
/// 16 disparities ("lanes") of one pixel at a time: the reference, in plain C written so that
/// compilers vectorize it. The other match_vector_*.h give the same results, some of them for
/// several pixels at a time: the pixels in a vector are its "members", each with 16 lanes and its
/// own pointer in the arrays `at`.
#ifndef VERGENCE_STEREO_MATCH_MATCH_VECTOR_PLAIN_H
#define VERGENCE_STEREO_MATCH_MATCH_VECTOR_PLAIN_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "stereo/match/match_state.h"

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

/*@ assigns \nothing;
    ensures \result == \min(a, b); */
static inline uint8_t lower_u8(uint8_t a, uint8_t b) {
    return a < b ? a : b;
}

/// Loads 16 bytes of each member, from at[member] + offset.
/*@ requires \valid_read(at) && \valid_read(at[0] + (offset .. offset + MATCH_LANES - 1));
    assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] == at[0][offset + i]; */
static inline struct vector vector_load(const uint8_t *const at[], ptrdiff_t offset) {
    struct vector result;
    memcpy(result.lane, at[0] + offset, MATCH_LANES);
    return result;
}

/*@ requires \valid_read(at) && \valid(at[0] + (offset .. offset + MATCH_LANES - 1));
    assigns at[0][offset .. offset + MATCH_LANES - 1];
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> at[0][offset + i] == value.lane[i]; */
static inline void vector_store(uint8_t *const at[], ptrdiff_t offset, struct vector value) {
    memcpy(at[0] + offset, value.lane, MATCH_LANES);
}

/// All lanes of a member are its byte at[member][offset].
/*@ requires \valid_read(at) && \valid_read(at[0] + offset);
    assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] == at[0][offset]; */
static inline struct vector vector_each(const uint8_t *const at[], ptrdiff_t offset) {
    struct vector result;
    memset(result.lane, at[0][offset], MATCH_LANES);
    return result;
}

/*@ assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] == value; */
static inline struct vector vector_all(uint8_t value) {
    struct vector result;
    memset(result.lane, value, MATCH_LANES);
    return result;
}

/*@ requires \valid_read(at) && \valid_read(at[0] + offset);
    assigns \nothing;
    ensures \result.first == (at[0][offset] & 0xff) && \result.second == at[0][offset] >> 8; */
static inline struct vector_shares vector_shares_each(const match_share *const at[],
                                                      ptrdiff_t offset) {
    const match_share pair = at[0][offset];
    return (struct vector_shares){(uint8_t)(pair & 0xff), (uint8_t)(pair >> 8)};
}

/*@ assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] == \min(a.lane[i],
   b.lane[i]); */
static inline struct vector vector_min(struct vector a, struct vector b) {
    struct vector result;
    /*@ loop invariant 0 <= i <= MATCH_LANES;
        loop invariant \forall integer j; 0 <= j < i ==> result.lane[j] == \min(a.lane[j],
       b.lane[j]); loop assigns i, result; loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES; i++) {
        result.lane[i] = lower_u8(a.lane[i], b.lane[i]);
    }
    return result;
}

/// a + b, at most 255.
/*@ assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] == \min(a.lane[i] +
   b.lane[i], 255); */
static inline struct vector vector_add(struct vector a, struct vector b) {
    struct vector result;
    /*@ loop invariant 0 <= i <= MATCH_LANES;
        loop invariant \forall integer j; 0 <= j < i ==> result.lane[j] == \min(a.lane[j] +
       b.lane[j], 255); loop assigns i, result; loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES; i++) {
        const uint8_t room = (uint8_t)(UINT8_MAX - b.lane[i]);
        result.lane[i] = (uint8_t)(lower_u8(a.lane[i], room) + b.lane[i]);
    }
    return result;
}

/// a - b, at least 0.
/*@ assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] == \max(a.lane[i] -
   b.lane[i], 0); */
static inline struct vector vector_sub(struct vector a, struct vector b) {
    struct vector result;
    /*@ loop invariant 0 <= i <= MATCH_LANES;
        loop invariant \forall integer j; 0 <= j < i ==> result.lane[j] == \max(a.lane[j] -
       b.lane[j], 0); loop assigns i, result; loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES; i++) {
        result.lane[i] = (uint8_t)(a.lane[i] - lower_u8(a.lane[i], b.lane[i]));
    }
    return result;
}

/*@ assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] == (a.lane[i] | b.lane[i]);
 */
static inline struct vector vector_or(struct vector a, struct vector b) {
    struct vector result;
    /*@ loop invariant 0 <= i <= MATCH_LANES;
        loop invariant \forall integer j; 0 <= j < i ==> result.lane[j] == (a.lane[j] | b.lane[j]);
        loop assigns i, result;
        loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES; i++) {
        result.lane[i] = (uint8_t)(a.lane[i] | b.lane[i]);
    }
    return result;
}

/// Each lane gets its lower neighbour; lane 0 the last one of `before`.
/*@ assigns \nothing;
    ensures \result.lane[0] == before.lane[MATCH_LANES - 1];
    ensures \forall integer i; 1 <= i < MATCH_LANES ==> \result.lane[i] == here.lane[i - 1]; */
static inline struct vector vector_up(struct vector here, struct vector before) {
    struct vector result;
    result.lane[0] = before.lane[MATCH_LANES - 1];
    /*@ loop invariant 1 <= i <= MATCH_LANES;
        loop invariant result.lane[0] == before.lane[MATCH_LANES - 1];
        loop invariant \forall integer j; 1 <= j < i ==> result.lane[j] == here.lane[j - 1];
        loop assigns i, result;
        loop variant MATCH_LANES - i; */
    for (int i = 1; i < MATCH_LANES; i++) {
        result.lane[i] = here.lane[i - 1];
    }
    return result;
}

/// Each lane gets its upper neighbour; the last lane the first one of `after`.
/*@ assigns \nothing;
    ensures \result.lane[MATCH_LANES - 1] == after.lane[0];
    ensures \forall integer i; 0 <= i < MATCH_LANES - 1 ==> \result.lane[i] == here.lane[i + 1]; */
static inline struct vector vector_down(struct vector here, struct vector after) {
    struct vector result;
    result.lane[MATCH_LANES - 1] = after.lane[0];
    /*@ loop invariant 0 <= i <= MATCH_LANES - 1;
        loop invariant result.lane[MATCH_LANES - 1] == after.lane[0];
        loop invariant \forall integer j; 0 <= j < i ==> result.lane[j] == here.lane[j + 1];
        loop assigns i, result;
        loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES - 1; i++) {
        result.lane[i] = here.lane[i + 1];
    }
    return result;
}

/// (a first + b second + half) / MATCH_WEIGHT_ONE.
/*@ requires shares.first + shares.second == MATCH_WEIGHT_ONE;
    assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==>
        \min(a.lane[i], b.lane[i]) <= \result.lane[i] <= \max(a.lane[i], b.lane[i]); */
static inline struct vector vector_blend(struct vector a, struct vector b,
                                         struct vector_shares shares) {
    struct vector result;
    /*@ loop invariant 0 <= i <= MATCH_LANES;
        loop invariant \forall integer j; 0 <= j < i ==>
            \min(a.lane[j], b.lane[j]) <= result.lane[j] <= \max(a.lane[j], b.lane[j]);
        loop assigns i, result;
        loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES; i++) {
        /*@ assert \let low = \min(a.lane[i], b.lane[i]); \let high = \max(a.lane[i], b.lane[i]);
                low * shares.first <= a.lane[i] * shares.first <= high * shares.first &&
                low * shares.second <= b.lane[i] * shares.second <= high * shares.second; */
        const uint16_t mixed =
            (uint16_t)(a.lane[i] * shares.first + b.lane[i] * shares.second + MATCH_WEIGHT_ONE / 2);
        /*@ assert \min(a.lane[i], b.lane[i]) * MATCH_WEIGHT_ONE <= mixed - MATCH_WEIGHT_ONE / 2 <=
                   \max(a.lane[i], b.lane[i]) * MATCH_WEIGHT_ONE; */
        result.lane[i] = (uint8_t)(mixed / MATCH_WEIGHT_ONE);
    }
    return result;
}

/// All lanes of a member are its lowest lane.
/*@ assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] == \result.lane[0];
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[0] <= value.lane[i];
    ensures \exists integer i; 0 <= i < MATCH_LANES && \result.lane[0] == value.lane[i]; */
static inline struct vector vector_lowest(struct vector value) {
    uint8_t lowest = UINT8_MAX;
    /*@ loop invariant 0 <= i <= MATCH_LANES;
        loop invariant \forall integer j; 0 <= j < i ==> lowest <= value.lane[j];
        loop invariant i == 0 ? lowest == UINT8_MAX : (\exists integer j; 0 <= j < i && lowest ==
       value.lane[j]); loop assigns i, lowest; loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES; i++) {
        lowest = lower_u8(lowest, value.lane[i]);
    }
    return vector_all(lowest);
}

/// Lane 0 of a member.
/*@ assigns \nothing;
    ensures \result == value.lane[0]; */
static inline uint8_t vector_first(struct vector value, int member) {
    (void)member;
    return value.lane[0];
}

/// Bit 16 member + i is set if lane i of both is equal.
/*@ assigns \nothing;
    ensures \result <= UINT16_MAX;
    ensures \result != 0 <==> (\exists integer i; 0 <= i < MATCH_LANES && a.lane[i] == b.lane[i]);
 */
static inline uint32_t vector_equal(struct vector a, struct vector b) {
    uint32_t bits = 0;
    /*@ loop invariant 0 <= i <= MATCH_LANES;
        loop invariant bits < 1 << i;
        loop invariant \forall integer j; 0 <= j < i && a.lane[j] == b.lane[j] ==> bits != 0;
        loop invariant bits != 0 ==> (\exists integer j; 0 <= j < i && a.lane[j] == b.lane[j]);
        loop assigns i, bits;
        loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES; i++) {
        bits |= (uint32_t)(a.lane[i] == b.lane[i]) << i;
    }
    return bits;
}

// Bits set in the three bytes together: a carry-save adder first, so that two byte counts serve
// three bytes.
/*@ assigns \nothing;
    ensures \result <= 3 * 8; */
static inline uint8_t count_bits(uint8_t a, uint8_t b, uint8_t c) {
    uint8_t ones = (uint8_t)(a ^ b ^ c);
    uint8_t twos = (uint8_t)((a & b) | (c & (a ^ b)));
    ones = (uint8_t)(ones - ((ones >> 1) & 0x55));
    twos = (uint8_t)(twos - ((twos >> 1) & 0x55));
    ones = (uint8_t)((ones & 0x33) + ((ones >> 2) & 0x33));
    twos = (uint8_t)((twos & 0x33) + ((twos >> 2) & 0x33));
    //@ assert ones / 16 <= 4 && ones % 16 <= 4 && twos / 16 <= 4 && twos % 16 <= 4;
    const uint8_t both = (uint8_t)(ones + 2 * twos);
    //@ assert both / 16 + both % 16 <= 24;
    return (uint8_t)((both & 0x0f) + (both >> 4));
}

/// MATCH_CENSUS_WEIGHT for each bit in which the census planes differ, plus the difference of the
/// gradients, at most MATCH_GRADIENT_TRUNCATION.
/*@ requires \valid_read(left + (0 .. MATCH_CENSUS_PLANES));
    requires \valid_read(right + (0 .. MATCH_CENSUS_PLANES));
    assigns \nothing;
    ensures \forall integer i; 0 <= i < MATCH_LANES ==> \result.lane[i] <= MATCH_COST_MAX; */
static inline struct vector vector_cost(const struct vector left[MATCH_CENSUS_PLANES + 1],
                                        const struct vector right[MATCH_CENSUS_PLANES + 1]) {
    struct vector result;
    /*@ loop invariant 0 <= i <= MATCH_LANES;
        loop invariant \forall integer j; 0 <= j < i ==> result.lane[j] <= MATCH_COST_MAX;
        loop assigns i, result;
        loop variant MATCH_LANES - i; */
    for (int i = 0; i < MATCH_LANES; i++) {
        const uint8_t differing =
            count_bits(left[0].lane[i] ^ right[0].lane[i], left[1].lane[i] ^ right[1].lane[i],
                       left[2].lane[i] ^ right[2].lane[i]);
        const uint8_t a = left[3].lane[i];
        const uint8_t b = right[3].lane[i];
        const uint8_t step = a > b ? (uint8_t)(a - b) : (uint8_t)(b - a);
        result.lane[i] =
            (uint8_t)(MATCH_CENSUS_WEIGHT * differing + lower_u8(step, MATCH_GRADIENT_TRUNCATION));
    }
    return result;
}

#endif

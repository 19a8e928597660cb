// SPDX-License-Identifier: Apache-2.0
/// The steps on all lanes of one pixel ("cells") for the Blackfin, which has no registers for 16
/// lanes: four cells are a word of memory, two of them the halves of a register of its 16-bit
/// operations, and its two multipliers blend a pair at once. Cells begin at multiples of four, and
/// lanes are a multiple of 16. For stereo/match, whose plain vectors give the same results.
#ifndef VERGENCE_STEREO_BFIN_CELLS_H
#define VERGENCE_STEREO_BFIN_CELLS_H

#include <stdint.h>
#include <string.h>

enum {
    CELLS_MAX = 1024,    // lanes
    CELLS_BIT_COST = 4,  // of a bit of the census
};

/// The share of the first of two values in a blend, in 1/128, as a fraction of 16 bits.
static inline uint16_t cells_share(uint32_t share) {
    return (uint16_t)(share << 9);
}

/// That of the second one.
static inline uint16_t cells_share_swapped(uint16_t share) {
    return (uint16_t)-share;
}

/// Both shares, the first one in the lower half. They are a little larger, so that no blend is half
/// way between two values: the processor rounds these to even ones.
static inline uint32_t cells_shares(uint16_t share) {
    uint32_t shares;
    __asm__("%0 = PACK(%1.L, %1.L);\n %0 = %2 -|+ %0;"
            : "=&d"(shares)
            : "d"(share), "d"(0x00010001));
    return shares;
}

/// A value in both halves.
static inline uint32_t cells_pair(uint32_t value) {
    return value << 16 | value;
}

// Begins a loop; I0 chooses the bytes of BYTEUNPACK.
#define CELLS_PREPARE                      \
    "R0 = 0;\n I0 = R0;\n"                 \
    "R0 = [%[from]++];\n"                  \
    "(R3, R2) = BYTEUNPACK R1:0;\n"        \
    "R5 = 255;\n R4 = PACK(R2.L, R5.L);\n" \
    "LSETUP (1f, 2f) LC0 = %[words];\n"

// The cells in R3 and R2 become min(here, neighbours + R6). R4: the first cell and the one before
// it, then the last one and the one after it, which is loaded by `next`. R5 is used. `own` loads
// R0.
#define CELLS_LEAN(next, own)   \
    "R5 = PACK(R3.L, R2.H);\n"  \
    "R4 = MIN(R4, R5) (V);\n"   \
    "R4 = R4 +|+ R6;\n"         \
    "R2 = MIN(R2, R4) (V)" next \
    ";\n"                       \
    "R4 = PACK(R0.L, R3.H);\n"  \
    "R5 = MIN(R5, R4) (V);\n"   \
    "R5 = R5 +|+ R6;\n"         \
    "R3 = MIN(R3, R5) (V)" own ";\n"

#define CELLS_NEXT "|| R0 = B[%[from]] (Z)"
#define CELLS_END ";\n R0 = 255"

// Ends a turn: stores four cells, and unpacks the next ones.
#define CELLS_TURN "2: (R3, R2) = BYTEUNPACK R1:0 || [%[to]++] = R5;\n"
#define CELLS_LAST "[%[to]++] = R5;\n"

// R5: four cells.
#define CELLS_BLEND(more)                                              \
    "A1 = R2.H * R7.L, A0 = R2.L * R7.L (FU);\n"                       \
    "(R5, R0) = BYTEUNPACK R1:0;\n"                                    \
    "R2.H = (A1 += R0.H * R7.H), R2.L = (A0 += R0.L * R7.H) (FU);\n"   \
    "A1 = R3.H * R7.L, A0 = R3.L * R7.L (FU);\n"                       \
    "R3.H = (A1 += R5.H * R7.H), R3.L = (A0 += R5.L * R7.H) (FU)" more \
    ";\n"                                                              \
    "R5 = BYTEPACK(R2, R3);\n"

#define CELLS_CLOBBERED "I0", "A0", "A1", "LC0", "LT0", "LB0", "CC", "memory"

/// to = blend(lean(from), own): each cell of `from` may be replaced by a neighbour plus `price`.
/// `to` may be one of the others.
static inline void cells_blend(const uint8_t *from, const uint8_t *own, uint8_t *to, uint32_t price,
                               uint16_t share, int lanes) {
    uint32_t prices = cells_pair(price), shares = cells_shares(share);
    __asm__ volatile(CELLS_PREPARE                                        //
                     "1:\n" CELLS_LEAN(CELLS_NEXT, "|| R0 = [%[own]++]")  //
                     CELLS_BLEND("|| R0 = [%[from]++]")                   //
                     CELLS_TURN                                           //
                         CELLS_LEAN(CELLS_END, "|| R0 = [%[own]++]")      //
                     CELLS_BLEND("")                                      //
                     CELLS_LAST
                     : [from] "+a"(from), [own] "+a"(own), [to] "+a"(to), "+q6"(prices),
                       "+q7"(shares)
                     : [words] "a"(lanes / 4 - 1)
                     : "R0", "R1", "R2", "R3", "R4", "R5", CELLS_CLOBBERED);
}

static inline void cells_copy(const uint8_t *from, uint8_t *to, int lanes) {
    uint32_t word;
    __asm__ volatile(
        "I0 = %[from];\n"
        "LSETUP (1f, 2f) LC0 = %[words];\n"
        "1: %[word] = [I0++];\n"
        "2: [%[to]++] = %[word];\n"
        : [to] "+a"(to), [word] "=&d"(word)
        : [from] "a"(from), [words] "a"(lanes / 4)
        : "I0", "LC0", "LT0", "LB0", "memory");
}

/// Copies cells from any address. Up to seven more are read behind them, and three before them.
static inline void cells_copy_from(const uint8_t *from, uint8_t *to, int lanes) {
    __asm__ volatile(
        "I0 = %[from];\n"
        "DISALGNEXCPT || R0 = [I0++];\n"
        "DISALGNEXCPT || R1 = [I0++];\n"
        "LSETUP (1f, 2f) LC0 = %[words];\n"
        "1: (R3, R2) = BYTEUNPACK R1:0;\n"
        "R0 = R1;\n"
        "R2 = BYTEPACK(R2, R3);\n"
        "2: DISALGNEXCPT || [%[to]++] = R2 || R1 = [I0++];\n"
        : [to] "+a"(to)
        : [from] "a"(from), [words] "a"(lanes / 4)
        : "R0", "R1", "R2", "R3", "I0", "LC0", "LT0", "LB0", "memory");
}

/// Cell i becomes from[i + shift] for first <= i < beyond.
static inline void cells_place(const uint8_t *from, int shift, int first, int beyond,
                               uint8_t *cells) {
    typedef uint32_t word __attribute__((may_alias));
    if (first >= beyond) {
        return;
    }
    const int begin = first & -4, end = (beyond + 3) & -4;
    word *const front = (word *)(void *)(cells + begin);
    word *const back = (word *)(void *)(cells + end - 4);
    const uint32_t before = *front, behind = *back;
    cells_copy_from(from + begin + shift, cells + begin, end - begin);
    const uint32_t in_back = UINT32_MAX >> 8 * (end - beyond);
    *back = (*back & in_back) | (behind & ~in_back);
    const uint32_t in_front = UINT32_MAX << 8 * (first - begin);
    *front = (*front & in_front) | (before & ~in_front);
}

/// Moves all cells up by `rise`; those from beyond the ends are `low` and `high`.
static inline void cells_shear(uint8_t *cells, int rise, uint8_t low, uint8_t high, int lanes) {
    if (rise > 0) {
        memmove(cells + rise, cells, (size_t)(lanes - rise));
        memset(cells, low, (size_t)rise);
    } else if (rise < 0) {
        memmove(cells, cells - rise, (size_t)(lanes + rise));
        memset(cells + lanes + rise, high, (size_t)-rise);
    }
}

/// The same of a copy at `to`, if they move; where they are then.
static inline const uint8_t *cells_sheared(const uint8_t *from, int rise, uint8_t low, uint8_t high,
                                           uint8_t *to, int lanes) {
    if (rise == 0) {
        return from;
    }
    memmove(to, from, (size_t)lanes);
    cells_shear(to, rise, low, high, lanes);
    return to;
}

#define CELLS_JOIN(more)                                               \
    "(R5, R0) = BYTEUNPACK R1:0;\n"                                    \
    "A1 = R0.H * R7.L, A0 = R0.L * R7.L (FU);\n"                       \
    "R0.H = (A1 += R2.H * R7.H), R0.L = (A0 += R2.L * R7.H) (FU);\n"   \
    "A1 = R5.H * R7.L, A0 = R5.L * R7.L (FU);\n"                       \
    "R5.H = (A1 += R3.H * R7.H), R5.L = (A0 += R3.L * R7.H) (FU);\n"   \
    "R5 = BYTEPACK(R0, R5) || R0 = [%[own]++];\n"                      \
    "A1 = R2.H * R1.L, A0 = R2.L * R1.L (FU) || [%[joined]++] = R5;\n" \
    "(R5, R0) = BYTEUNPACK R1:0;\n"                                    \
    "R2.H = (A1 += R0.H * R1.H), R2.L = (A0 += R0.L * R1.H) (FU);\n"   \
    "A1 = R3.H * R1.L, A0 = R3.L * R1.L (FU);\n"                       \
    "R3.H = (A1 += R5.H * R1.H), R3.L = (A0 += R5.L * R1.H) (FU)" more \
    ";\n"                                                              \
    "R5 = BYTEPACK(R2, R3);\n"

/// joined = blend(joined, lean(average)), then average = blend(lean(average), own).
static inline void cells_join(uint8_t *average, const uint8_t *own, uint8_t *joined, uint32_t price,
                              uint16_t join, uint16_t share, int lanes) {
    const uint8_t *from = average;
    uint32_t prices = cells_pair(price), join_shares = cells_shares(join);
    uint32_t shares = cells_shares(share);
    __asm__ volatile(
        CELLS_PREPARE                                         //
        "1:\n" CELLS_LEAN(CELLS_NEXT, "|| R0 = [%[joined]]")  //
        CELLS_JOIN("|| R0 = [%[from]++]")                     //
        CELLS_TURN                                            //
            CELLS_LEAN(CELLS_END, "|| R0 = [%[joined]]")      //
        CELLS_JOIN("")                                        //
        CELLS_LAST
        : [from] "+a"(from), [own] "+a"(own), [joined] "+a"(joined), [to] "+a"(average),
          "+q6"(prices), "+q7"(join_shares), "+q1"(shares)
        : [words] "a"(lanes / 4 - 1)
        : "R0", "R2", "R3", "R4", "R5", CELLS_CLOBBERED);
}

#define CELLS_PATH(more)                  \
    "R2 = MIN(R2, R7) (V);\n"             \
    "R3 = MIN(R3, R7) (V);\n"             \
    "R2 = BYTEPACK(R2, R3);\n"            \
    "(R5, R0) = BYTEOP16P(R3:2, R1:0);\n" \
    "R1 = MIN(R1, R0) (V);\n"             \
    "R1 = MIN(R1, R5) (V);\n"             \
    "R5 = BYTEPACK(R0, R5)" more ";\n"

/// to = cost + min(from, its neighbours + p1, p2): a path cost before its lowest one, which is
/// returned, is subtracted. `to` may be `from`.
static inline uint32_t cells_path(const uint8_t *from, const uint8_t *cost, uint8_t *to,
                                  uint32_t p1, uint32_t p2, int lanes) {
    uint32_t small = cells_pair(p1), large = cells_pair(p2), lowest = cells_pair(INT16_MAX);
    __asm__ volatile("I1 = %[none];\n" CELLS_PREPARE                       //
                     "1:\n" CELLS_LEAN(CELLS_NEXT, "|| R0 = [%[cost]++]")  //
                     CELLS_PATH("|| R0 = [%[from]++]")                     //
                     CELLS_TURN                                            //
                         CELLS_LEAN(CELLS_END, "|| R0 = [%[cost]++]")      //
                     CELLS_PATH("")                                        //
                     CELLS_LAST
                     : [from] "+a"(from), [cost] "+a"(cost), [to] "+a"(to), "+q6"(small),
                       "+q7"(large), "+q1"(lowest)
                     : [words] "a"(lanes / 4 - 1), [none] "a"(0)
                     : "R0", "R2", "R3", "R4", "R5", "I1", CELLS_CLOBBERED);
    const uint32_t low = lowest & 0xffff, high = lowest >> 16;
    return low < high ? low : high;
}

/// Subtracts the lowest cell from all.
static inline void cells_lower(uint8_t *cells, uint32_t lowest, int lanes) {
    const uint32_t four = lowest * 0x01010101u;
    uint32_t even, odd, low_even, low_odd;
    __asm__ volatile(
        "I0 = %[from];\n"
        "%[even] = [%[from]++];\n"
        "%[low_even] = %[even] - %[four] (NS) || %[odd] = [%[from]++];\n"
        "LSETUP (1f, 2f) LC0 = %[more];\n"
        "1: %[low_odd] = %[odd] - %[four] (NS) || %[even] = [%[from]++] || [I0++] = "
        "%[low_even];\n"
        "2: %[low_even] = %[even] - %[four] (NS) || %[odd] = [%[from]++] || [I0++] = "
        "%[low_odd];\n"
        "%[low_odd] = %[odd] - %[four] (NS) || [I0++] = %[low_even];\n"
        "[I0++] = %[low_odd];\n"
        : [from] "+a"(cells), [even] "=&d"(even), [odd] "=&d"(odd), [low_even] "=&d"(low_even),
          [low_odd] "=&d"(low_odd)
        : [four] "d"(four), [more] "a"(lanes / 8 - 1)
        : "I0", "LC0", "LT0", "LB0", "CC", "memory");
}

/// Subtracts the lowest cell from all of a path, and writes sum = min(above, most) + min(path,
/// most). `sum` may be `above`.
static inline void cells_sum(uint8_t *path, uint32_t lowest, const uint8_t *above, uint8_t *sum,
                             uint32_t most, int lanes) {
    uint32_t four = lowest * 0x01010101u, limit = cells_pair(most);
    __asm__ volatile(
        "R0 = 0;\n I0 = R0;\n"
        "R0 = [%[path]];\n"
        "R0 = R0 - R1;\n"
        "LSETUP (1f, 2f) LC0 = %[words];\n"
        "1: (R3, R2) = BYTEUNPACK R1:0 || [%[path]++] = R0;\n"
        "R2 = MIN(R2, R6) (V) || R0 = [%[above]++];\n"
        "(R5, R4) = BYTEUNPACK R1:0;\n"
        "R3 = MIN(R3, R6) (V);\n"
        "R4 = MIN(R4, R6) (V);\n"
        "R5 = MIN(R5, R6) (V);\n"
        "R2 = R2 +|+ R4;\n"
        "R3 = R3 +|+ R5 || R0 = [%[path]];\n"
        "R2 = BYTEPACK(R2, R3);\n"
        "2: R0 = R0 - R1 (NS) || [%[sum]++] = R2;\n"
        : [path] "+a"(path), [above] "+a"(above), [sum] "+a"(sum), "+q1"(four), "+q6"(limit)
        : [words] "a"(lanes / 4)
        : "R0", "R2", "R3", "R4", "R5", CELLS_CLOBBERED);
}

/// Subtracts the lowest cell from all of a path, and writes the sums with the other paths, of 16
/// bits; two of them before `total` are overwritten.
static inline void cells_total(uint8_t *path, uint32_t lowest, const uint8_t *sum, uint16_t *total,
                               int lanes) {
    const uint32_t four = lowest * 0x01010101u;
    uint16_t *to = total - 2;
    __asm__ volatile(
        "R0 = 0;\n I0 = R0;\n I1 = R0;\n I2 = %[sum];\n I3 = %[path];\n"
        "R0 = [I3++];\n"
        "LSETUP (1f, 2f) LC0 = %[words];\n"
        "1: R0 = R0 - %[four] (NS) || [%[to]++] = R5 || R2 = [I2++];\n"
        "(R5, R4) = BYTEOP16P(R3:2, R1:0) || [%[path]++] = R0;\n"
        "2: MNOP || [%[to]++] = R4 || R0 = [I3++];\n"
        "[%[to]++] = R5;\n"
        : [path] "+a"(path), [to] "+a"(to)
        : [sum] "a"(sum), [words] "a"(lanes / 4), [four] "d"(four)
        : "R0", "R1", "R2", "R3", "R4", "R5", "I1", "I2", "I3", CELLS_CLOBBERED);
}

/// The first lane of the lowest sum, if it is below 255, else 0. The processor keeps the lowest of
/// the even and of the odd lanes, and where the next ones were.
static inline int cells_lowest(const uint16_t *total, int lanes, uint32_t *lowest) {
    const uint16_t *at = total;
    const uint16_t *even_at = total + 2, *odd_at = total + 2;
    int32_t even = UINT8_MAX, odd = UINT8_MAX;
    uint32_t word;
    __asm__ volatile(
        "A0 = %[even];\n A1 = %[odd];\n"
        "%[word] = [%[at]++];\n"
        "LSETUP (1f, 1f) LC0 = %[pairs];\n"
        "1: (%[odd_at], %[even_at]) = SEARCH %[word] (LT) || %[word] = [%[at]++];\n"
        "%[even] = A0.W;\n %[odd] = A1.W;\n"
        : [at] "+qA"(at), [word] "=&d"(word), [even_at] "+d"(even_at), [odd_at] "+d"(odd_at),
          [even] "+d"(even), [odd] "+d"(odd)
        : [pairs] "a"(lanes / 2)
        : "A0", "A1", "LC0", "LT0", "LB0", "CC", "memory");
    const int even_lane = (int)(even_at - total) - 2, odd_lane = (int)(odd_at - total) - 1;
    *lowest = (uint32_t)(odd < even ? odd : even);
    return odd < even || (odd == even && odd_lane < even_lane) ? odd_lane : even_lane;
}

static inline uint32_t cells_least(const uint16_t *total, int lanes) {
    uint32_t lowest = cells_pair(UINT8_MAX), word;
    __asm__ volatile(
        "LSETUP (1f, 1f) LC0 = %[pairs];\n"
        "%[word] = [%[total]++];\n"
        "1: %[lowest] = MIN(%[lowest], %[word]) (V) || %[word] = [%[total]++];\n"
        : [total] "+a"(total), [word] "=&d"(word), [lowest] "+d"(lowest)
        : [pairs] "a"(lanes / 2)
        : "LC0", "LT0", "LB0", "CC", "memory");
    const uint32_t low = lowest & 0xffff, high = lowest >> 16;
    return low < high ? low : high;
}

/// The winner of the sums: its lane, and its margin over the best of those that are not its
/// neighbours. A sum counts as 255 at most. `total` has one more sum on both sides, and changes.
static inline int cells_choose(uint16_t *total, int lanes, uint8_t *margin) {
    uint32_t lowest;
    const int lane = cells_lowest(total, lanes, &lowest);
    total[lane - 1] = total[lane] = total[lane + 1] = UINT8_MAX;
    *margin = (uint8_t)(cells_least(total, lanes) - lowest);
    return lane;
}

/// Costs of a pixel: CELLS_BIT_COST for each bit in which `census` differs from the pixel's own,
/// plus the difference of the gradients, at most `most`. `gradient` may have any address; up to
/// seven bytes behind it are read.
static inline void cells_cost(const uint32_t *census, uint32_t own, const uint8_t *gradient,
                              uint32_t own_gradient, uint32_t most, uint8_t *to, int lanes) {
    uint32_t gradients = own_gradient * 0x01010101u, limit = cells_pair(most);
    __asm__ volatile(
        "I0 = %[gradient];\n I1 = %[none];\n"
        "DISALGNEXCPT || R0 = [I0++];\n"
        "DISALGNEXCPT || R1 = [I0++];\n"
        "LSETUP (1f, 2f) LC0 = %[words];\n"
        "1: (R5, R4) = BYTEOP16M(R1:0, R3:2);\n"
        "R4 = ABS R4 (V) || R0 = [%[census]++];\n"
        "R5 = ABS R5 (V) || R3 = [%[census]++];\n"
        "R4 = MIN(R4, R6) (V);\n"
        "R5 = MIN(R5, R6) (V);\n"
        "R4 = BYTEPACK(R4, R5) || R5 = [%[census]++];\n"
        "R0 = R0 ^ R7;\n"
        "R0.L = ONES R0;\n"
        "R3 = R3 ^ R7;\n"
        "R3.L = ONES R3;\n"
        "R0 = PACK(R3.L, R0.L) || R3 = [%[census]++];\n"
        "R5 = R5 ^ R7;\n"
        "R5.L = ONES R5;\n"
        "R3 = R3 ^ R7;\n"
        "R3.L = ONES R3;\n"
        "R3 = PACK(R3.L, R5.L);\n"
        "R3 = BYTEPACK(R0, R3);\n"
        "R3 <<= 2;\n"
        "R3 = R3 + R4;\n"
        "R0 = R1;\n"
        "2: DISALGNEXCPT || [%[to]++] = R3 || R1 = [I0++];\n"
        : [census] "+a"(census), [to] "+a"(to)
        : [gradient] "a"(gradient), "q7"(own), "q6"(limit),
          "q2"(gradients), [words] "a"(lanes / 4), [none] "a"(0)
        : "R0", "R1", "R3", "R4", "R5", "I0", "I1", "LC0", "LT0", "LB0", "CC", "memory");
}

#endif

// SPDX-License-Identifier: Apache-2.0
/// Rows of bytes on the Blackfin, four at a time. The rows begin at multiples of four bytes, and
/// have bytes beyond their ends: what is written there has no meaning. For stereo/match, whose
/// plain C gives the same results.
#ifndef VERGENCE_STEREO_BFIN_BYTES_H
#define VERGENCE_STEREO_BFIN_BYTES_H

#include "stereo/bfin/pairs.h"

typedef uint32_t four_bytes __attribute__((may_alias));

/// Values of four columns: of the first and the third one, of the second and the fourth one.
struct column_pairs {
    pair16 even, odd;
};

static inline struct column_pairs bytes_load(const uint8_t *row, ptrdiff_t x) {
    const uint32_t four = *(const four_bytes *)(row + x);
    return (struct column_pairs){(pair16)(four & 0x00ff00ff), (pair16)(four >> 8 & 0x00ff00ff)};
}

/// Of values that fit a byte.
static inline void bytes_store(uint8_t *row, ptrdiff_t x, pair16 even, pair16 odd) {
    *(four_bytes *)(row + x) = (uint32_t)even | (uint32_t)odd << 8;
}

/// a x + b y, below 2^15. The weights are both halves of a pair.
static inline pair16 pair_weigh(pair16 a, pair16 x, pair16 b, pair16 y) {
    pair16 result;
    __asm__(
        "A1 = %1.H * %2.H, A0 = %1.L * %2.L (IS);\n"
        "%0.H = (A1 += %3.H * %4.H), %0.L = (A0 += %3.L * %4.L) (IS);\n"
        : "=d"(result)
        : "d"(x), "d"(a), "d"(y), "d"(b)
        : "A0", "A1");
    return result;
}

/// (a x + b y) / 2^16, rounded down, of numbers without a sign.
static inline pair16 pair_weigh_high(pair16 a, pair16 x, pair16 b, pair16 y) {
    pair16 result;
    __asm__(
        "A1 = %1.H * %2.H, A0 = %1.L * %2.L (FU);\n"
        "%0.H = (A1 += %3.H * %4.H), %0.L = (A0 += %3.L * %4.L) (TFU);\n"
        : "=d"(result)
        : "d"(x), "d"(a), "d"(y), "d"(b)
        : "A0", "A1");
    return result;
}

/// The mean of a pixel and its neighbours: those before and after it have the weight `side` of 16
/// along each direction. `box` has room for 12 columns of 16 bits more. `to` may be `above`.
static inline void bytes_smooth(const uint8_t *above, const uint8_t *row, const uint8_t *below,
                                int width, int side, void *box, uint8_t *to) {
    const pair16 share = pair_of(side), own = pair_of(16 - 2 * side);
    // Half a unit of the result, as the weights along a direction are 16 together.
    const pair16 half = pair_of(8);
    struct column_pairs *const sums = box, *sum = sums;
    for (int x = -4; x < width + 4; x += 4, sum++) {
        const struct column_pairs here = bytes_load(row, x);
        const struct column_pairs up = bytes_load(above, x), down = bytes_load(below, x);
        sum->even = pair_weigh(own, here.even, share, up.even + down.even) + half;
        sum->odd = pair_weigh(own, here.odd, share, up.odd + down.odd) + half;
    }
    const pair16 share_q8 = pair_of(side << 8), own_q8 = pair_of((16 - 2 * side) << 8);
    struct column_pairs before = sums[0], here = sums[1];
    sum = sums + 2;
    for (int x = 0; x < width; x += 4, sum++) {
        const struct column_pairs after = *sum;
        const pair16 even = pair_between(before.odd, here.odd) + here.odd;
        const pair16 odd = here.even + pair_between(here.even, after.even);
        bytes_store(to, x, pair_weigh_high(own_q8, here.even, share_q8, even),
                    pair_weigh_high(own_q8, here.odd, share_q8, odd));
        before = here;
        here = after;
    }
}

// 128 + slope / 2, rounded towards 0, in a byte.
static inline pair16 slope_byte(pair16 slope) {
    const pair16 shifted = pair_halve(slope - pair_sign(slope)) + pair_of(128);
    return pair_max(pair_min(shifted, pair_of(255)), pair_of(0));
}

static inline pair16 weigh_121(pair16 a, pair16 b, pair16 c) {
    return a + b + b + c;
}

/// Sobel's gradient along a row, by `slope_byte`.
static inline void bytes_gradient(const uint8_t *above, const uint8_t *row, const uint8_t *below,
                                  int width, uint8_t *gradient) {
    struct column_pairs before, here = {pair_of(0), pair_of(0)}, after = here;
    for (int x = -8; x < width; x += 4) {
        const struct column_pairs up = bytes_load(above, x + 4), middle = bytes_load(row, x + 4);
        const struct column_pairs down = bytes_load(below, x + 4);
        before = here;
        here = after;
        after.even = weigh_121(up.even, middle.even, down.even);
        after.odd = weigh_121(up.odd, middle.odd, down.odd);
        if (x >= 0) {
            bytes_store(gradient, x, slope_byte(here.odd - pair_between(before.odd, here.odd)),
                        slope_byte(pair_between(here.even, after.even) - here.even));
        }
    }
}

/// Raises `along` and `down` to the differences of a row from the columns before and from the row
/// above, if these are larger.
static inline void bytes_raise(const uint8_t *above, const uint8_t *row, int width, uint8_t *along,
                               uint8_t *down) {
    pair16 before = bytes_load(row, -4).odd;
    for (int x = 0; x < width; x += 4) {
        const struct column_pairs here = bytes_load(row, x), up = bytes_load(above, x);
        struct column_pairs most = bytes_load(along, x);
        bytes_store(along, x,
                    pair_max(most.even, pair_abs(here.even - pair_between(before, here.odd))),
                    pair_max(most.odd, pair_abs(here.odd - here.even)));
        most = bytes_load(down, x);
        bytes_store(down, x, pair_max(most.even, pair_abs(here.even - up.even)),
                    pair_max(most.odd, pair_abs(here.odd - up.odd)));
        before = here.odd;
    }
}

static inline uint32_t lower_halves(pair16 low, pair16 high) {
    uint32_t result;
    __asm__("%0 = PACK(%2.L, %1.L);" : "=d"(result) : "d"(low), "d"(high));
    return result;
}

static inline uint32_t upper_halves(pair16 low, pair16 high) {
    uint32_t result;
    __asm__("%0 = PACK(%2.H, %1.H);" : "=d"(result) : "d"(low), "d"(high));
    return result;
}

/// The bits of three planes in a word each, in reverse; `pad` words are before the row's last one
/// and all behind its first one up to `length`, which repeat these.
static inline void bytes_reverse_census(uint8_t *const plane[3], int width, int pad, int length,
                                        uint32_t *words) {
    uint32_t *at = words + pad + width;
    int x = 0;
    for (; x + 4 <= width; x += 4) {
        const struct column_pairs a = bytes_load(plane[0], x), b = bytes_load(plane[1], x);
        const struct column_pairs c = bytes_load(plane[2], x);
        const pair16 even = a.even | b.even << 8, odd = a.odd | b.odd << 8;
        *--at = lower_halves(even, c.even);
        *--at = lower_halves(odd, c.odd);
        *--at = upper_halves(even, c.even);
        *--at = upper_halves(odd, c.odd);
    }
    for (; x < width; x++) {
        *--at = plane[0][x] | (uint32_t)plane[1][x] << 8 | (uint32_t)plane[2][x] << 16;
    }
    for (int i = 0; i < pad; i++) {
        words[i] = words[pad];
    }
    for (int i = pad + width; i < length; i++) {
        words[i] = words[pad + width - 1];
    }
}

#endif

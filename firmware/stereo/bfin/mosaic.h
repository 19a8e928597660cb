// SPDX-License-Identifier: Apache-2.0
/// Colours of a Bayer mosaic, two pixels of one colour at a time, for values of at most
/// MOSAIC_BITS. For stereo/image/debayer.c, which has the same for all processors.
#ifndef VERGENCE_STEREO_BFIN_MOSAIC_H
#define VERGENCE_STEREO_BFIN_MOSAIC_H

#include <stdbool.h>

#include "stereo/bfin/pairs.h"

enum { MOSAIC_BITS = 10 };  // twice the sum of two estimates then fits 16 bits

/// The product of two numbers of 16 bits without a sign, in one cycle.
static inline uint32_t product_u16(uint32_t a, uint32_t b) {
    uint32_t result;
    __asm__("%0 = %1.L * %2.L (FU);" : "=d"(result) : "d"(a), "d"(b));
    return result;
}

/// Of two words of four pixels the second ones, or the first ones.
__attribute__((always_inline)) static inline pair16 mosaic_every_other(pair16 a, pair16 b,
                                                                       const bool second) {
    pair16 result;
    if (second) {
        __asm__("%0 = PACK(%2.H, %1.H);" : "=d"(result) : "d"(a), "d"(b));
    } else {
        __asm__("%0 = PACK(%2.L, %1.L);" : "=d"(result) : "d"(a), "d"(b));
    }
    return result;
}

/// The same of words of 32 bits whose values fit 16.
static inline pair16 mosaic_pack(int32_t a, int32_t b) {
    pair16 result;
    __asm__("%0 = PACK(%2.L, %1.L);" : "=d"(result) : "d"(a), "d"(b));
    return result;
}

/// Twice the estimate of which the change is less, or both.
static inline pair16 mosaic_choose(pair16 one, pair16 one_change, pair16 other,
                                   pair16 other_change) {
    const pair16 more = pair_max(pair_min(one_change - other_change, pair_of(1)), pair_of(-1));
    pair16 beyond;
    __asm__("%0.H = %1.H * %2.H, %0.L = %1.L * %2.L (IS);"
            : "=d"(beyond)
            : "d"(one - other), "d"(more));
    return one + other - beyond;
}

/// (a + 2^(times - 1)) / 2^times, rounded down.
__attribute__((always_inline)) static inline pair16 mosaic_round(pair16 a, const int times) {
    pair16 result;
    __asm__("%0 = %1 >>> %2 (V);" : "=d"(result) : "d"(a + pair_of(1 << (times - 1))), "i"(times));
    return result;
}

static inline pair16 mosaic_limit(pair16 value, pair16 largest) {
    return pair_min(pair_max(value, pair_of(0)), largest);
}

/// Green at columns x, x + 2, ... of row[2] of five, below `end`, into green[x]: as long as there
/// are two, four columns before `end`. `odd`: x is. Returns the bits of all pixels.
__attribute__((always_inline)) static inline uint32_t mosaic_green(const uint16_t *const row[5],
                                                                   int x, int end, int32_t *green,
                                                                   const bool odd) {
    pair16 all = pair_of(0);
    for (int base = x - odd; base + odd + 2 < end; base += 4) {
        const uint16_t *here = row[2] + base;
        const pair16 before = pair_load(here, -2), first = pair_load(here, 0);
        const pair16 second = pair_load(here, 2), after = pair_load(here, 4);
        pair16 up2 = pair_load(row[0], base), up = pair_load(row[1], base);
        pair16 down = pair_load(row[3], base), down2 = pair_load(row[4], base);
        const pair16 next_up2 = pair_load(row[0], base + 2), next_up = pair_load(row[1], base + 2);
        const pair16 next_down = pair_load(row[3], base + 2);
        const pair16 next_down2 = pair_load(row[4], base + 2);
        all = all | before | first | second | after | up2 | up | down | down2 | next_up2 | next_up |
              next_down | next_down2;
        up2 = mosaic_every_other(up2, next_up2, odd);
        up = mosaic_every_other(up, next_up, odd);
        down = mosaic_every_other(down, next_down, odd);
        down2 = mosaic_every_other(down2, next_down2, odd);
        const pair16 middle = mosaic_every_other(first, second, odd);
        const pair16 left2 = mosaic_every_other(before, first, odd);
        const pair16 right2 = mosaic_every_other(second, after, odd);
        const pair16 left = odd ? mosaic_every_other(first, second, false)
                                : mosaic_every_other(before, first, true);
        const pair16 right = odd ? mosaic_every_other(second, after, false)
                                 : mosaic_every_other(first, second, true);
        const pair16 twice = middle + middle;
        const pair16 along_bend = twice - left2 - right2, across_bend = twice - up2 - down2;
        const pair16 along_change = pair_abs(left - right) + pair_abs(along_bend);
        const pair16 across_change = pair_abs(up - down) + pair_abs(across_bend);
        const pair16 sides = left + right, ends = up + down;
        const pair16 both_q3 = mosaic_choose(sides + sides + along_bend, along_change,
                                             ends + ends + across_bend, across_change);
        const pair16 estimate = mosaic_round(both_q3, 3);
        green[base + odd] = estimate[0];
        green[base + odd + 2] = estimate[1];
    }
    return (uint32_t)(int32_t)all;
}

/// Rows above, at and below the one whose colours are estimated.
struct mosaic_rows {
    const uint16_t *up, *here, *down;
    const int32_t *green_up, *green, *green_down;
};

// Columns x - 1 and x + 1 of a row, or x + 1 and x + 3.
__attribute__((always_inline)) static inline pair16 mosaic_beside(const uint16_t *row, int x,
                                                                  const bool odd, const int more) {
    const uint16_t *from = row + x - odd + more;
    return odd ? mosaic_every_other(pair_load(from, 0), pair_load(from, 2), false)
               : mosaic_every_other(pair_load(from, -2), pair_load(from, 0), true);
}

__attribute__((always_inline)) static inline pair16 mosaic_own(const uint16_t *row, int x,
                                                               const bool odd) {
    return mosaic_every_other(pair_load(row, x - odd), pair_load(row, x - odd + 2), odd);
}

static inline void mosaic_store(uint16_t *rgb, pair16 value) {
    rgb[0] = (uint16_t)value[0];
    rgb[6] = (uint16_t)value[1];
}

/// Two pixels, x and x + 2, whose colour `own` (0 or 2) was measured.
__attribute__((always_inline)) static inline void mosaic_site(const struct mosaic_rows *rows, int x,
                                                              const bool odd, int own,
                                                              pair16 largest, uint16_t *rgb) {
    const pair16 up_left = mosaic_beside(rows->up, x, odd, 0);
    const pair16 up_right = mosaic_beside(rows->up, x, odd, 2);
    const pair16 down_left = mosaic_beside(rows->down, x, odd, 0);
    const pair16 down_right = mosaic_beside(rows->down, x, odd, 2);
    const int32_t *up = rows->green_up + x, *down = rows->green_down + x;
    const pair16 green = mosaic_pack(rows->green[x], rows->green[x + 2]), twice = green + green;
    const pair16 falling_bend = twice - mosaic_pack(up[-1], up[1]) - mosaic_pack(down[1], down[3]);
    const pair16 rising_bend = twice - mosaic_pack(up[1], up[3]) - mosaic_pack(down[-1], down[1]);
    const pair16 falling_change = pair_abs(up_left - down_right) + pair_abs(falling_bend);
    const pair16 rising_change = pair_abs(up_right - down_left) + pair_abs(rising_bend);
    const pair16 both_q2 = mosaic_choose(up_left + down_right + falling_bend, falling_change,
                                         up_right + down_left + rising_bend, rising_change);
    mosaic_store(rgb + 3 * x + own, pair_min(mosaic_own(rows->here, x, odd), largest));
    mosaic_store(rgb + 3 * x + 1, mosaic_limit(green, largest));
    mosaic_store(rgb + 3 * x + 2 - own, mosaic_limit(mosaic_round(both_q2, 2), largest));
}

/// The same where green was measured.
__attribute__((always_inline)) static inline void mosaic_green_site(const struct mosaic_rows *rows,
                                                                    int x, const bool odd, int own,
                                                                    pair16 largest, uint16_t *rgb) {
    const int32_t *at = rows->green + x, *up = rows->green_up + x, *down = rows->green_down + x;
    const pair16 green = mosaic_pack(at[0], at[2]);
    const pair16 beside_q1 = mosaic_beside(rows->here, x, odd, 0) - mosaic_pack(at[-1], at[1]) +
                             mosaic_beside(rows->here, x, odd, 2) - mosaic_pack(at[1], at[3]);
    const pair16 above_q1 = mosaic_own(rows->up, x, odd) - mosaic_pack(up[0], up[2]) +
                            mosaic_own(rows->down, x, odd) - mosaic_pack(down[0], down[2]);
    mosaic_store(rgb + 3 * x + own, mosaic_limit(green + mosaic_round(beside_q1, 1), largest));
    mosaic_store(rgb + 3 * x + 1, mosaic_limit(green, largest));
    mosaic_store(rgb + 3 * x + 2 - own, mosaic_limit(green + mosaic_round(above_q1, 1), largest));
}

/// Colours of columns x, x + 2, ..., whose colour `own` was measured, and of those in between, as
/// long as there are two of each before `end`. Returns the first column that is left.
__attribute__((always_inline)) static inline int mosaic_row(const struct mosaic_rows *rows, int x,
                                                            int end, const bool odd, int own,
                                                            int32_t largest, uint16_t *rgb) {
    const pair16 most = pair_of(largest);
    for (; x + 3 < end; x += 4) {
        mosaic_site(rows, x, odd, own, most, rgb);
        mosaic_green_site(rows, x + 1, !odd, own, most, rgb);
    }
    return x;
}

/// Grey and colour of a row of pixels: for luma of ITU-R BT.601 what `tone` has, for red, green and
/// blue what the three of `balanced` have.
static inline void mosaic_tones(const uint16_t *rgb, int width, const uint8_t *tone,
                                uint8_t *const balanced[3], uint8_t *grey, uint8_t *colour) {
#define MOSAIC_TONE(index, table, to)                                                         \
    index " = " index " + " table ";\n %[at] = " index ";\n" index " = B[%[at]] (Z);\n B[" to \
          "++] = " index ";\n"
#define MOSAIC_TONE_AT(index, table, last, to)                                             \
    "%[at] = " index ";\n %[at] = %[at] + %[" table "];\n" index " = B[%[at]] (Z);\n" last \
    "B[%[" to "]++] = " index ";\n"
    const uint8_t *at;
    uint32_t red = (uint32_t)(uintptr_t)balanced[0], green = (uint32_t)(uintptr_t)balanced[1];
    // The upper halves of R0 to R3 stay 0. A1: half a unit of luma.
    __asm__ volatile(
        "R0 = 0;\n R1 = 0;\n R2 = 0;\n R3 = 0;\n"
        "R3.L = 0x8000;\n A1 = R3;\n R3 = 0;\n"
        "R4.L = 77 * 256;\n R4.H = 150 * 256;\n R7.L = 29 * 256;\n"
        "LSETUP (1f, 2f) LC0 = %[width];\n"
        "1: A0 = A1 || R0.L = W[%[rgb]++];\n"
        "A0 += R0.L * R4.L (FU) || R1.L = W[%[rgb]++];\n"
        "A0 += R1.L * R4.H (FU) || R2.L = W[%[rgb]++];\n"
        "R3.L = (A0 += R2.L * R7.L) (TFU);\n"                                          //
        MOSAIC_TONE_AT("R3", "tone", "", "grey") MOSAIC_TONE("R0", "R5", "%[colour]")  //
        MOSAIC_TONE("R1", "R6", "%[colour]") MOSAIC_TONE_AT("R2", "blue", "2: ", "colour")

        : [rgb] "+b"(rgb), [grey] "+a"(grey), [colour] "+a"(colour), [at] "=&a"(at), "+q5"(red),
          "+q6"(green)
        : [tone] "a"(tone), [blue] "a"(balanced[2]), [width] "a"(width)
        : "R0", "R1", "R2", "R3", "R4", "R7", "A0", "A1", "LC0", "LT0", "LB0", "memory");
#undef MOSAIC_TONE_AT
#undef MOSAIC_TONE
}

#endif

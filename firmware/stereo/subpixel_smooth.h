// SPDX-License-Identifier: Apache-2.0
// Part of the text of subpixel_text.h, which has the numbers: smooths a row.
#ifndef VERGENCE_STEREO_SUBPIXEL_SMOOTH_H
#define VERGENCE_STEREO_SUBPIXEL_SMOOTH_H

#include "stereo/subpixel_strip.h"

// Adds opposite neighbours, `down` rows and `along` columns away, that both agree with the middle:
// unbiased on any slope, also next to an edge. Disparities modulo 256 px suffice: surfaces that far
// apart are taken for one where their distance differs from it by less than SMOOTH_STEP_Q8.
#define ADD_PAIR(down, along)                                                                  \
    do {                                                                                       \
        const uint16_t one = (uint16_t)(top - below[down][x + (along)]);                       \
        const uint16_t other = (uint16_t)(top - above[down][x - (along)]);                     \
        const uint16_t farther = one > other ? one : other;                                    \
        const uint16_t far =                                                                   \
            (uint16_t)(farther | bad_below[down][x + (along)] | bad_above[down][x - (along)]); \
        const uint16_t agree = (uint16_t) - (far <= 2 * SMOOTH_STEP_Q8);                       \
        const uint16_t both = (uint16_t)((one + other) & agree);                               \
        sum = (uint16_t)(sum + both);                                                          \
        pairs_here = (uint16_t)(pairs_here - agree);                                           \
        if (last) {                                                                            \
            const int16_t bend = (int16_t)(both - (agree & 2 * SMOOTH_STEP_Q8));               \
            rough_here = (uint16_t)(rough_here + (bend < 0 ? -bend : bend));                   \
        }                                                                                      \
    } while (0)

#define ADD_PAIRS_BELOW(down) \
    ADD_PAIR(down, -2);       \
    ADD_PAIR(down, -1);       \
    ADD_PAIR(down, 0);        \
    ADD_PAIR(down, 1);        \
    ADD_PAIR(down, 2)

// Row y smoothed, from `present` into `next`; the last time also what sigma depends on.
// Inlined, since compilers do not take `last` out of the loop.
__attribute__((always_inline)) static inline void smooth_row(const struct subpixel_strip *strip,
                                                             const struct subpixel_ring *present,
                                                             int y, uint16_t *next,
                                                             const bool last) {
    const struct subpixel_ring *bad = &strip->bad;
    const uint16_t *above[SUBPIXEL_RADIUS + 1];
    const uint16_t *below[SUBPIXEL_RADIUS + 1];
    const uint16_t *bad_above[SUBPIXEL_RADIUS + 1];
    const uint16_t *bad_below[SUBPIXEL_RADIUS + 1];
    for (int j = 0; j <= SUBPIXEL_RADIUS; j++) {
        above[j] = subpixel_row(present, y - j);
        below[j] = subpixel_row(present, y + j);
        bad_above[j] = subpixel_row(bad, y - j);
        bad_below[j] = subpixel_row(bad, y + j);
    }
    const int columns = strip->columns;
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        const uint16_t middle = above[0][x];
        const uint16_t top = (uint16_t)(middle + SMOOTH_STEP_Q8);
        uint16_t sum = 0;  // of SMOOTH_STEP_Q8 - difference
        uint16_t pairs_here = 0;
        uint16_t rough_here = 0;
        ADD_PAIR(0, 1);
        ADD_PAIR(0, 2);
        ADD_PAIRS_BELOW(1);
        ADD_PAIRS_BELOW(2);
        const int16_t excess = (int16_t)(2 * SMOOTH_STEP_Q8 * pairs_here - sum);
        const int16_t sign = (int16_t)(excess >> 15);
        const uint16_t size = (uint16_t)((excess ^ sign) - sign);
        const uint16_t mean = divide_short(size, (uint16_t)(1 + 2 * pairs_here), SMOOTH_BITS);
        const uint16_t move = mean < SMOOTH_MAX_Q8 ? mean : SMOOTH_MAX_Q8;
        next[x] = (uint16_t)(middle + (move ^ sign) - sign);
        if (last) {
            strip->pairs[x] = pairs_here;
            strip->rough[x] = rough_here;
        }
    }
}

#endif

// SPDX-License-Identifier: Apache-2.0
// Part of the text of subpixel_text.h, which has the numbers: the stages for the Blackfin, two
// pixels at a time where 16 bits suffice, and nothing for pixels without a disparity.
#ifndef VERGENCE_STEREO_SUBPIXEL_BFIN_H
#define VERGENCE_STEREO_SUBPIXEL_BFIN_H

#include "stereo/bfin/quotient.h"
#include "stereo/bfin/windows.h"
#include "stereo/subpixel_strip.h"

enum { BOTH = -1 };  // of a pair of masks, as a word

// The rows of a window, the uppermost first.
struct window_rows {
    const uint16_t *disparity[SUBPIXEL_WINDOW], *bad[SUBPIXEL_WINDOW];
};

struct smooth_sums {
    pair16 sum, pairs, rough;  // sum: of the differences, middle - neighbour
};

// Elements x + along and x + along + 1 of a row.
static inline pair16 load_beside(const uint16_t *row, int x, const int along) {
    return along % 2 == 0
               ? pair_load(row, x + along)
               : pair_between(pair_load(row, x + along - 1), pair_load(row, x + along + 1));
}

// Adds opposite neighbours to two pixels' sums, as ADD_PAIR in subpixel_smooth.h; both agree where
// the larger of top - neighbour, which begin at INT16_MIN, is at most 2 SMOOTH_STEP_Q8 from there.
__attribute__((always_inline)) static inline void add_neighbours(const struct window_rows *rows,
                                                                 int x, const int down,
                                                                 const int along, const bool last,
                                                                 pair16 top,
                                                                 struct smooth_sums *sums) {
    const int below = SUBPIXEL_RADIUS + down, above = SUBPIXEL_RADIUS - down;
    const pair16 one = top - load_beside(rows->disparity[below], x, along);
    const pair16 other = top - load_beside(rows->disparity[above], x, -along);
    const pair16 far = pair_max(one, other) | load_beside(rows->bad[below], x, along) |
                       load_beside(rows->bad[above], x, -along);
    const pair16 agree = pair_sign(pair_less(far, pair_of(INT16_MIN + 2 * SMOOTH_STEP_Q8 + 1)));
    const pair16 both = (one + other) & agree;
    sums->sum = sums->sum + both;
    sums->pairs = sums->pairs - agree;
    if (last) {
        sums->rough = sums->rough + pair_abs(both - (agree & pair_of(2 * SMOOTH_STEP_Q8)));
    }
}

// All opposite neighbours of two pixels where some are bad.
__attribute__((always_inline)) static inline struct smooth_sums sum_window(
    const struct window_rows *rows, int x, const bool last) {
    const pair16 top =
        pair_load(rows->disparity[SUBPIXEL_RADIUS], x) + pair_of(INT16_MIN + SMOOTH_STEP_Q8);
    struct smooth_sums sums = {pair_of(0), pair_of(0), pair_of(0)};
    add_neighbours(rows, x, 0, 1, last, top, &sums);
    add_neighbours(rows, x, 0, 2, last, top, &sums);
#pragma GCC unroll 2
    for (int down = 1; down <= SUBPIXEL_RADIUS; down++) {
#pragma GCC unroll 5
        for (int along = -SUBPIXEL_RADIUS; along <= SUBPIXEL_RADIUS; along++) {
            add_neighbours(rows, x, down, along, last, top, &sums);
        }
    }
    // Each pair has added 2 SMOOTH_STEP_Q8.
    sums.sum = sums.sum - pair_up(sums.pairs, 8) - pair_up(sums.pairs, 7);
    _Static_assert(2 * SMOOTH_STEP_Q8 == 256 + 128, "");
    return sums;
}

// The same where none is.
static inline struct smooth_sums sum_whole_window(const struct window_rows *rows, int x,
                                                  pair16 middle) {
    const uint16_t *row[SUBPIXEL_WINDOW];
    for (int i = 0; i < SUBPIXEL_WINDOW; i++) {
        row[i] = rows->disparity[i] + x - 2;
    }
    const struct windows_agreement agreement = windows_agree(row, middle, SMOOTH_STEP_Q8);
    return (struct smooth_sums){
        agreement.sum - pair_up(agreement.pairs, 8) - pair_up(agreement.pairs, 7), agreement.pairs,
        agreement.rough};
}

// 2^15 / (1 + 2 pairs), rounded up: the product with a sum is exact up to SMOOTH_MAX_Q8.
static const int16_t smooth_share[COUNT_MAX / 2 + 1] = {32767, 10923, 6554, 4682, 3641, 2979, 2521,
                                                        2185,  1928,  1725, 1561, 1425, 1311};

static inline void store_smoothed(uint16_t *next, int x, pair16 middle, pair16 sum, pair16 share) {
    const pair16 down = pair_sign(sum);
    const pair16 mean = pair_fraction(pair_abs(sum), share);
    const pair16 move = pair_min(mean, pair_of(SMOOTH_MAX_Q8));
    pair_store(next, x, middle - (move ^ down) + down);
}

// What the columns of a window have in common.
struct smooth_columns {
    uint16_t *high, *low, *sum, *bad;
};

// Whether all neighbours of two pixels agree with both.
static inline bool is_flat(const struct smooth_columns *columns, int x, pair16 middle) {
    const pair16 high =
        pair_max(pair_max(pair_load(columns->high, x - 2), pair_load(columns->high, x)),
                 pair_load(columns->high, x + 2));
    const pair16 low =
        pair_min(pair_min(pair_load(columns->low, x - 2), pair_load(columns->low, x)),
                 pair_load(columns->low, x + 2));
    const pair16 rise = pair_less(pair_max(high, pair_turn(high)), middle);
    const pair16 fall = pair_less(middle, pair_min(low, pair_turn(low)));
    const pair16 farther = pair_max(rise, fall);
    return pair_word(pair_sign(farther - pair_of(SMOOTH_STEP_Q8 + 1))) == BOTH;
}

// Sum of the differences where all agree.
static inline pair16 sum_flat(const uint16_t *sums, int x, pair16 middle) {
    const pair16 before = pair_load(sums, x - 2), here = pair_load(sums, x);
    const pair16 after = pair_load(sums, x + 2);
    const pair16 all =
        before + here + after + pair_between(before, here) + pair_between(here, after);
    return pair_up(middle, 4) + pair_up(middle, 3) + middle - all;
}

// As in subpixel_smooth.h.
__attribute__((always_inline)) static inline void smooth_row(const struct subpixel_strip *strip,
                                                             const struct subpixel_ring *present,
                                                             int y, uint16_t *next,
                                                             const bool last) {
    struct window_rows rows;
    for (int i = 0; i < SUBPIXEL_WINDOW; i++) {
        rows.disparity[i] = subpixel_row(present, y + i - SUBPIXEL_RADIUS);
        rows.bad[i] = subpixel_row(&strip->bad, y + i - SUBPIXEL_RADIUS);
    }
    const struct smooth_columns columns = {(uint16_t *)strip->four, (uint16_t *)strip->count,
                                           strip->column, (uint16_t *)strip->between};
    windows_least(rows.bad, columns.bad, strip->columns);
    if (!last) {
        windows_reduce(rows.disparity, columns.high, columns.low, columns.sum, strip->columns);
    }
    for (int x = 0; x < strip->columns; x += 2) {
        const pair16 middle = pair_load(rows.disparity[SUBPIXEL_RADIUS], x);
        if (pair_word(pair_load(rows.bad[SUBPIXEL_RADIUS], x)) == BOTH) {
            continue;
        }
        const bool whole = pair_word(pair_load(columns.bad, x - 2) | pair_load(columns.bad, x) |
                                     pair_load(columns.bad, x + 2)) == 0;
        if (!last && whole && is_flat(&columns, x, middle)) {
            store_smoothed(next, x, middle, sum_flat(columns.sum, x, middle),
                           pair_of(smooth_share[COUNT_MAX / 2]));
            continue;
        }
        const struct smooth_sums sums =
            whole ? sum_whole_window(&rows, x, middle) : sum_window(&rows, x, last);
        store_smoothed(next, x, middle, sums.sum,
                       (pair16){smooth_share[sums.pairs[0]], smooth_share[sums.pairs[1]]});
        if (last) {
            pair_store(strip->pairs, x, sums.pairs);
            pair_store(strip->rough, x, sums.rough);
        }
    }
}

static inline pair16 load_bytes(const uint8_t *first, const uint8_t *second, const int i) {
    pair16 result;
    __asm__("%0 = PACK(%1.L, %2.L);"
            : "=d"(result)
            : "d"((int32_t)second[i]), "d"((int32_t)first[i]));
    return result;
}

// Cut off towards zero, as halved() does.
__attribute__((always_inline)) static inline pair16 halved_pair(pair16 a, const int times) {
    return pair_down(a + pair_down_unsigned(pair_sign(a), 16 - times), times);
}

// As difference_row() in subpixel_text.h, where `left` has the left image's pixels and `slope` the
// differences of those on both sides of them.
static inline void difference_pair(const uint8_t *first, const uint8_t *second, pair16 t,
                                   pair16 left, pair16 rise, pair16 *gradient, pair16 *difference) {
    const pair16 p0 = load_bytes(first, second, 0), p1 = load_bytes(first, second, 1);
    const pair16 p2 = load_bytes(first, second, 2), p3 = load_bytes(first, second, 3);
    const pair16 fall = p1 - p2, ends = p3 - p0, before = p0 - p1;
    const pair16 cubic = pair_up(fall + fall + fall + ends, 4);
    const pair16 square = pair_up(before - pair_up(fall, 2) - ends, 4);
    const pair16 inner = square + pair_rounded_fraction(cubic, t);
    const pair16 across = pair_up(p2 - p0, 4);
    const pair16 middle = across + pair_rounded_fraction(inner, t);
    const pair16 value_q2 = pair_up(p1, 2) + pair_rounded_fraction(middle, pair_down(t, 3));
    const pair16 change = pair_up(p3 - p2 + before, 4);
    const pair16 slope = across + pair_rounded_fraction(change, t);
    *gradient = halved_pair(rise + halved_pair(slope, 4), 1);
    *difference = value_q2 - pair_up(left, 2);
}

// Places, fetches and compares row y: place_row(), fetch_row() and difference_row() of
// subpixel_text.h.
static void compare_row(const struct subpixel_strip *strip, const struct subpixel_step *step, int y,
                        const struct subpixel_terms *in) {
    const uint16_t *disparity = subpixel_row(&step->smooth, y);
    const uint16_t *whole = subpixel_row(&strip->whole, y), *bad = subpixel_row(&strip->bad, y);
    const uint8_t *left = left_row(strip, y), *right = image_u8_row(&strip->input->right, y);
    const pair16 last = pair_of(strip->input->left.width - 4), none = pair_of(0);
    const pair16 low_byte = pair_of(255);
    pair16 column_q8 =
        (pair16){(int16_t)(strip->x_first * 256), (int16_t)((strip->x_first + 1) * 256)};
    for (int x = 0; x < strip->columns; x += 2, column_q8 = column_q8 + pair_of(512)) {
        pair16 used = ~pair_load(bad, x), gradient = none, difference = none;
        if (pair_word(used) != 0) {
            const pair16 place = column_q8 - pair_load(disparity, x), start = pair_load(whole, x);
            const pair16 moved = pair_down(place - pair_up(start, 8), 8);
            const pair16 first = start - pair_of(1) + moved;
            const pair16 column = pair_min(pair_max(first, none), last);
            used = used & ~pair_sign(none - pair_abs(first - column));
            const pair16 here = {left[x], left[x + 1]};
            const pair16 rise = {(int16_t)(left[x + 1] - left[x - 1]),
                                 (int16_t)(left[x + 2] - left[x])};
            difference_pair(right + column[0], right + column[1], pair_up(place & low_byte, 7),
                            here, rise, &gradient, &difference);
        }
        pair_store(in->used, x, used);
        pair_store(in->gradient, x, gradient & used);
        pair_store(in->difference, x, difference & used);
    }
}

// Scratch rows of sums over windows; the products of all are in four rows, one after the other.
struct window_sums {
    int16_t *count, *gradient, *difference;
    int32_t *products;
};

static inline struct window_sums window_sums(const struct subpixel_strip *strip) {
    return (struct window_sums){(int16_t *)strip->column, strip->between, (int16_t *)strip->count,
                                strip->gradient2};
}

// As in subpixel_text.h, and the sums over windows.
static void sum_columns(const struct subpixel_terms *in, const struct subpixel_terms *out,
                        const struct subpixel_sums *sums, const struct subpixel_strip *strip) {
    const struct window_sums window = window_sums(strip);
    const int columns = strip->columns;
    windows_values((int16_t *)out->used, (int16_t *)in->used, (int16_t *)sums->count, window.count,
                   columns);
    windows_values(in->gradient, out->gradient, sums->gradient, window.gradient, columns);
    windows_values(in->difference, out->difference, sums->difference, window.difference, columns);
    windows_products(in->gradient, in->gradient, out->gradient, out->gradient, sums->gradient2,
                     window.products, columns);
    windows_products(in->gradient, in->difference, out->gradient, out->difference, sums->product,
                     window.products + 1, columns);
    windows_products(in->difference, in->difference, out->difference, out->difference,
                     sums->difference2, window.products + 2, columns);
    windows_neighbours(in->difference, out->difference, sums->neighbours, window.products + 3,
                       columns);
}

// As bound_row() in subpixel_text.h, of one window.
static inline int32_t bound_of(int32_t gg, int32_t noise, int32_t n) {
    const int32_t texture = (gg * (n - 2) >> 4) - n * (noise >> 9);
    const int32_t part = noise >> 2, whole = texture << 4;
    if (n < COUNT_MIN || texture <= 0 || part >= whole + (whole >> 1)) {
        return BOUND_MAX_Q16;
    }
    const int32_t ratio = (int32_t)quotient_exact((uint32_t)part, (uint32_t)whole, VARIANCE_BITS);
    const int32_t variance = ratio * 455 >> 7;
    return variance < BOUND_MAX_Q16 ? variance : BOUND_MAX_Q16;
}

// As fit_row() in subpixel_fit.h.
static void fit_row(const struct subpixel_strip *strip, const struct subpixel_step *step, int y,
                    uint16_t *bound) {
    const struct window_sums window = window_sums(strip);
    int32_t *products = window.products + WINDOW_PRODUCTS * SUBPIXEL_RADIUS;
    const int columns = strip->columns - SUBPIXEL_RADIUS;
    _Static_assert(COUNT_MIN == 5 && SHIFT_BITS == 5 && MOVE_BITS == 7, "");
    _Static_assert(ROUNDING_VARIANCE == 43, "");
    windows_solve(window.count, window.gradient, window.difference, products,
                  subpixel_row(&step->smooth, y), subpixel_row(&step->fitted, y), columns);
    const uint16_t *bad = subpixel_row(&strip->bad, y);
    for (int x = 0; bound != NULL && x < columns; x++) {
        if (bad[x] == 0) {
            const int32_t *of = products + WINDOW_PRODUCTS * x;
            bound[x] = (uint16_t)bound_of(of[0], of[1], window.count[x]);
        }
    }
}

// As in subpixel_fit.h.
static void sigma_row(const struct subpixel_strip *strip, int y) {
    const uint16_t *bad = subpixel_row(&strip->bad, y), *bound_q16 = subpixel_row(&strip->bound, y);
    for (int x = 0; x < strip->columns; x++) {
        if (bad[x] != 0) {
            continue;
        }
        const int32_t pairs = strip->pairs[x];
        _Static_assert((int)ROUGH_BITS == 9, "");
        const int32_t mean_q8 =
            (int32_t)quotient_9_bits(strip->rough[x], (uint32_t)(pairs > 0 ? pairs : 1));
        const int32_t rough = product_16(mean_q8, mean_q8);
        const int32_t variance = bound_q16[x] + (ROUGH_SHARE_Q4 * rough >> 4) +
                                 product_16(MISSING_Q16, COUNT_MAX - 1 - 2 * pairs) +
                                 strip->floor_q16;
        int32_t root = 0;
#pragma GCC unroll 9
        for (int i = SIGMA_BITS - 1; i >= 0; i--) {
            const int32_t more = root | 1 << i;
            root = product_16(more, more) <= variance ? more : root;
        }
        strip->sigma[x] = (uint16_t)(root < SUBPIXEL_SIGMA_MAX_Q8 ? root : SUBPIXEL_SIGMA_MAX_Q8);
    }
}

#endif

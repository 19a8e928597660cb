// SPDX-License-Identifier: Apache-2.0
// Part of the text of subpixel_text.h, which has the numbers: compares the pixels of a row with the
// right image and fits its windows.
#ifndef VERGENCE_STEREO_SUBPIXEL_FIT_H
#define VERGENCE_STEREO_SUBPIXEL_FIT_H

#include "stereo/subpixel_strip.h"

// `numerator` / `denominator` in units of 2^(1 - bits), below 2^bits. The denominator is below
// 2^30; 0 gives 0.
static inline int32_t divide(int32_t numerator, int32_t denominator, const int bits) {
    const int32_t most = 2 * denominator - 1;
    int32_t rest = numerator < most ? numerator : most;
    int32_t quotient = 0;
    for (int i = 0; i < bits; i++) {
        const int32_t taken = rest >= denominator ? -1 : 0;
        rest = 2 * (rest - (taken & denominator));
        quotient = 2 * quotient - taken;
    }
    return quotient;
}

// The whole quotient of 16 bits, below 2^bits, for a denominator below 2^(15 - bits).
static inline uint16_t divide_short(uint16_t numerator, uint16_t denominator, const int bits) {
    uint16_t rest = numerator;
    uint16_t quotient = 0;
    for (int i = bits - 1; i >= 0; i--) {
        const uint16_t part = (uint16_t)(denominator << i);
        const uint16_t taken = rest >= part ? UINT16_MAX : 0;
        rest = (uint16_t)(rest - (part & taken));
        quotient = (uint16_t)(quotient | (taken & (1 << i)));
    }
    return quotient;
}

// a b / 2^15, rounded.
static inline int16_t fraction_of(int16_t a, int16_t b) {
    return (int16_t)((((int32_t)a * b >> 14) + 1) >> 1);
}

// a / 2^times, cut off towards zero: of slopes of rounded grey levels nothing must be left where
// there is no texture.
static inline int16_t halved(int16_t a, const int times) {
    return (int16_t)((a < 0 ? a + (1 << times) - 1 : a) >> times);
}

// Where the pixels of a row are found in the right image: the first of four columns around each,
// and the position between the middle two of them, in 1/32768. `used` masks those whose four
// columns are in the image.
static void place_row(const uint16_t *disparity, const int16_t *whole, const uint16_t *bad,
                      uint16_t *used, int width, const struct subpixel_strip *strip) {
    const int columns = strip->columns;
    const unsigned x_first = (unsigned)strip->x_first;
    const int16_t last = (int16_t)(width - 4);
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        // What changed since `whole` is less than 128 px.
        const uint16_t place = (uint16_t)(((x_first + (unsigned)x) << 8) - disparity[x]);
        const uint16_t moved = (uint16_t)(place - ((uint16_t)whole[x] << 8));
        const int16_t first = (int16_t)(whole[x] - 1 + ((int16_t)moved >> 8));
        const int16_t above = first < 0 ? 0 : first;
        strip->column[x] = (uint16_t)(above < last ? above : last);
        strip->between[x] = (int16_t)((place & 255) << 7);
        const uint16_t outside = first < 0 || first > last ? UINT16_MAX : 0;
        used[x] = (uint16_t) ~(outside | bad[x]);
    }
}

static void fetch_row(const uint8_t *right, const uint16_t *column, uint32_t *four, int columns) {
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        memcpy(&four[x], right + column[x], sizeof *four);
    }
}

static inline int16_t pixel_of(uint32_t four, const int i) {
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    return (int16_t)(four >> (24 - 8 * i) & 255);
#else
    return (int16_t)(four >> (8 * i) & 255);
#endif
}

// Gradients and differences of a row: cubic convolution (R. G. Keys, 1981) of the right image minus
// the left one, the mean of both slopes.
static void difference_row(const uint8_t *left, const uint16_t *used, int16_t *gradient,
                           int16_t *difference, const struct subpixel_strip *strip) {
    const int columns = strip->columns;
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        const int16_t p0 = pixel_of(strip->four[x], 0);
        const int16_t p1 = pixel_of(strip->four[x], 1);
        const int16_t p2 = pixel_of(strip->four[x], 2);
        const int16_t p3 = pixel_of(strip->four[x], 3);
        const int16_t t = strip->between[x];
        // In 1/16 grey level.
        const int16_t cubic = (int16_t)(16 * (3 * (p1 - p2) + p3 - p0));
        const int16_t square = (int16_t)(16 * (2 * p0 - 5 * p1 + 4 * p2 - p3));
        const int16_t inner = (int16_t)(square + fraction_of(cubic, t));
        const int16_t middle = (int16_t)(16 * (p2 - p0) + fraction_of(inner, t));
        const int16_t value_q2 = (int16_t)(4 * p1 + fraction_of(middle, (int16_t)(t >> 3)));
        const int16_t change = (int16_t)(16 * (p3 - p1 - p2 + p0));
        const int16_t slope = (int16_t)(16 * (p2 - p0) + fraction_of(change, t));
        const int16_t twice = (int16_t)(left[x + 1] - left[x - 1] + halved(slope, 4));
        gradient[x] = (int16_t)(halved(twice, 1) & used[x]);
        difference[x] = (int16_t)((value_q2 - 4 * left[x]) & used[x]);
    }
}

// Places, fetches and compares row y, smoothed, at its present disparities.
static void compare_row(const struct subpixel_strip *strip, const struct subpixel_step *step, int y,
                        const struct subpixel_terms *in) {
    const struct match_input *input = strip->input;
    place_row(subpixel_row(&step->smooth, y), (int16_t *)subpixel_row(&strip->whole, y),
              subpixel_row(&strip->bad, y), in->used, input->left.width, strip);
    fetch_row(image_u8_row(&input->right, y), strip->column, strip->four, strip->columns);
    difference_row(left_row(strip, y), in->used, in->gradient, in->difference, strip);
}

// Sums along the columns: the arriving row instead of the one that leaves.
static void sum_columns(const struct subpixel_terms *in, const struct subpixel_terms *out,
                        const struct subpixel_sums *sums, const struct subpixel_strip *strip) {
    const int columns = strip->columns;
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        sums->count[x] = (uint16_t)(sums->count[x] - in->used[x] + out->used[x]);
        sums->gradient[x] = (int16_t)(sums->gradient[x] + in->gradient[x] - out->gradient[x]);
        sums->difference[x] =
            (int16_t)(sums->difference[x] + in->difference[x] - out->difference[x]);
    }
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        const int16_t in_g = in->gradient[x];
        const int16_t in_d = in->difference[x];
        const int16_t out_g = out->gradient[x];
        const int16_t out_d = out->difference[x];
        sums->gradient2[x] += in_g * in_g - out_g * out_g;
        sums->product[x] += in_g * in_d - out_g * out_d;
        sums->difference2[x] += in_d * in_d - out_d * out_d;
        sums->neighbours[x] += in_d * in->difference[x - 1] - out_d * out->difference[x - 1];
    }
}

#define SUM_OF_WINDOW(sums, x) \
    ((sums)[(x)-2] + (sums)[(x)-1] + (sums)[x] + (sums)[(x) + 1] + (sums)[(x) + 2])

// Centred moments of the windows, times their number of pixels: gradient^2 in 1/4, product in 1/8,
// difference^2 in 1/16, below 2^30 each; and what correlated differences (noise blurred by
// rectification, a surface that the window does not follow) add: they carry less information, with
// their covariance as much as that many independent ones.
static void moment_row(const struct subpixel_sums *sums, const struct subpixel_strip *strip) {
    const int columns = strip->columns;
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        const int16_t n = (int16_t)SUM_OF_WINDOW(sums->count, x);
        const int16_t g = (int16_t)SUM_OF_WINDOW(sums->gradient, x);
        const int16_t d = (int16_t)SUM_OF_WINDOW(sums->difference, x);
        const int32_t covariance = n * SUM_OF_WINDOW(sums->neighbours, x) - d * d;
        strip->count[x] = n;
        strip->gradient2[x] = n * SUM_OF_WINDOW(sums->gradient2, x) - g * g;
        strip->product[x] = n * SUM_OF_WINDOW(sums->product, x) - g * d;
        strip->difference2[x] = n * SUM_OF_WINDOW(sums->difference2, x) - d * d;
        strip->together[x] = covariance > 0 ? covariance : 0;
    }
}

// Solves the windows' normal equations with the prior that the present disparity is good: without
// texture nothing moves. Leaves the variance of a difference, times count (count - 2).
static void solve_row(const struct subpixel_strip *strip, const uint16_t *present, uint16_t *next) {
    const int columns = strip->columns;
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        const int32_t n = strip->count[x];
        const int32_t gg = strip->gradient2[x];
        const int32_t product = strip->product[x];
        const int32_t gd = product < 0 ? -product : product;
        // What the best shift, in 1/32 px up to one, explains of difference^2; its error matters
        // little at the top of a parabola.
        const int32_t shift = divide(gd + (gg >> 5), gg, SHIFT_BITS);
        const int32_t explained = shift * (gd >> 3) - (shift * shift * ((gg + 31) >> 5) >> 3);
        const int32_t spread =
            strip->difference2[x] - (explained > 0 ? explained : 0) + strip->together[x];
        const int32_t least = ROUNDING_VARIANCE * n * (n - 2) / 16;
        const int32_t noise = spread > least ? spread : least;
        strip->together[x] = noise;
        // The disparities before the fit are good to 91 / 256 px, and the residuals of a window,
        // which are neither independent nor pure noise (interpolation, aliasing, reflections),
        // count 8 times: 8 / 91^2 (measured on pairs with ground truth).
        const int32_t stiffness = ((gg * (n - 2) >> 4) + noise) >> 1;
        const int32_t pull = (gd >> 1) * (n - 2) >> 3;
        const int32_t move = divide(pull, stiffness, MOVE_BITS);
        const int32_t moves = n >= COUNT_MIN && pull >> 1 < stiffness ? move : 0;
        next[x] = (uint16_t)(present[x] + (product < 0 ? -moves : moves));
    }
}

// Cramer-Rao bound of the windows, as smoothing leaves it: noise over gradients that are not noise.
static void bound_row(const struct subpixel_strip *strip, uint16_t *bound_q16) {
    const int columns = strip->columns;
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        const int32_t n = strip->count[x];
        const int32_t noise = strip->together[x];
        // Noise alone has a mean gradient^2 of 1/8 of its differences'.
        const int32_t texture = (strip->gradient2[x] * (n - 2) >> 4) - n * (noise >> 9);
        const int32_t positive = texture > 1 ? texture : 1;
        const int32_t ratio = divide(noise >> 2, positive << 4, VARIANCE_BITS);  // 1/32
        // Smoothing leaves 1/9: 1024 / 9 / 32.
        const int32_t variance = ratio * 455 >> 7;
        const int32_t known = n >= COUNT_MIN && texture > 0 && variance < BOUND_MAX_Q16;
        bound_q16[x] = (uint16_t)(known ? variance : BOUND_MAX_Q16);
    }
}

// Moves row y, from `smooth` into `fitted`, and after the last step bounds its variances.
static void fit_row(const struct subpixel_strip *strip, const struct subpixel_step *step, int y,
                    uint16_t *bound_q16) {
    moment_row(&step->sums, strip);
    solve_row(strip, subpixel_row(&step->smooth, y), subpixel_row(&step->fitted, y));
    if (bound_q16 != NULL) {
        bound_row(strip, bound_q16);
    }
}

// Predicted standard deviations.
static void sigma_row(const struct subpixel_strip *strip, int y) {
    const uint16_t *bound_q16 = subpixel_row(&strip->bound, y);
    const int32_t floor_q16 = strip->floor_q16;
    const int columns = strip->columns;
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        const uint16_t pairs = strip->pairs[x];
        const uint16_t any = pairs > 0 ? pairs : 1;
        const int32_t mean_q8 = divide_short(strip->rough[x], any, ROUGH_BITS);
        const int32_t variance = bound_q16[x] + (ROUGH_SHARE_Q4 * mean_q8 * mean_q8 >> 4) +
                                 MISSING_Q16 * (COUNT_MAX - 1 - 2 * pairs) + floor_q16;
        int32_t root = 0;
        for (int i = SIGMA_BITS - 1; i >= 0; i--) {
            const int32_t more = root + (1 << i);
            root = more * more <= variance ? more : root;
        }
        strip->sigma[x] = (uint16_t)(root < SUBPIXEL_SIGMA_MAX_Q8 ? root : SUBPIXEL_SIGMA_MAX_Q8);
    }
}

#endif

// SPDX-License-Identifier: Apache-2.0
// Smooths the disparities where neighbours agree, then moves each to where the window around it
// fits best; both twice, and smooths what came out. Each pixel of a window is compared at its own
// disparity, so that slanted and curved surfaces need no model, and only the correction is averaged
// over the window. The mean difference is removed, so that a difference of exposure does not
// matter. Source of the fit: B. D. Lucas and T. Kanade, "An iterative image registration
// technique", 1981. The predicted variance is a sum: the Cramer-Rao bound of that fit with the
// noise of the residuals, how much the fitted neighbours disagree, how many of them are missing or
// on another surface (the window then compares that one too), and what no window shows. The shares
// were chosen on the recorded pairs and rendered views of tools/bench stereo.
#include "stereo/subpixel.h"

#include <stdbool.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/root.h"
#include "stereo/image/reason.h"

enum {
    RADIUS = 2,
    WINDOW_ROWS = 2 * RADIUS + 1,
    SMOOTH_RADIUS = 2,
    SMOOTH_WINDOW = 2 * SMOOTH_RADIUS + 1,
    SMOOTH_ROWS = SMOOTH_WINDOW + 3,  // a window and three rows of sums
    UNUSED_Q8 = INT32_MIN / 4,        // incompatible with everything
    SMOOTH_STEP_Q8 = 192,  // neighbours with a larger difference of disparity belong to another
                           // surface
    // Limits of a correction and of what smoothing changes: two pixels in all.
    MOVE_MAX_Q8 = 128,
    SMOOTH_MAX_Q8 = 85,
    STEPS = 2,  // smoothing and fit
    // The disparities before the fit are good to 91 / 256 px, and the residuals of a window, which
    // are neither independent nor pure noise (interpolation, aliasing, reflections), count 8 times:
    // 8 / 91^2 (measured on pairs with ground truth).
    PRIOR_SHIFT = 10,
    NOISE_GRADIENT_SHIFT = 19,  // noise alone has a mean gradient^2 of 1/8 of its differences'
    BOUND_SHARE = 9,            // smoothing leaves this part of the bound
    BOUND_MAX_Q16 = 9600,       // path costs determine pixels without texture
    ROUGH_SHARE_Q4 = 11,        // weight of the neighbours' mean |second difference|, squared
    MISSING_Q16 = 900,          // variance for each pixel of the window that is missing
    // Of images that were rectified elsewhere and of our own.
    FLOOR_SIGMA_Q8 = 22,
    RESAMPLED_SIGMA_Q8 = 5,
    SIGMA_MAX_Q8 = 256,
    ROUNDING_VARIANCE_Q8 = 43,  // variance of the difference of two rounded grey levels, 1/256
    BAND_ROWS = 32,             // rows per part of the parallel work
};

// Sums over the window; gradient in 1/2 grey level a pixel, difference (right - left) in 1/16.
struct moments {
    int32_t count, gradient, difference, gradient2, product, difference2;
    int32_t neighbours;  // difference times that of the pixel to the left
};

struct work {
    const struct match_input *input;
    struct match_output *output;
    struct image_u16 *sigma_q8;  // the bound's variance in 1/65536 px^2 until the last smoothing
    int32_t *next_q8;            // width x height: disparities of the next step
    int32_t *rows_q8;            // a group: SMOOTH_ROWS padded rows
    struct moments *columns;     // a group: WINDOW_ROWS rows of width, then one row of column sums
    int width, height, bands;
    bool predicts;  // the smoothing is the last: writes sigma
};

// Groups share the bands of rows; each group has its own working memory.
struct group_context {
    const struct work *work;
    int groups;
};

static const int32_t *disparity_row(const struct work *work, int y) {
    return image_i32_row(&work->output->disparity_q8, y);
}

static const uint8_t *reason_row(const struct work *work, int y) {
    return image_u8_row(&work->output->reason, y);
}

// Value of a row at x_q8 (1/256 px) by cubic convolution (R. G. Keys, 1981), in 1/16 grey
// level. Ends are repeated.
static int32_t sample_q4(const uint8_t *row, int width, int32_t x_q8) {
    const int x = x_q8 >> 8;
    const int32_t t = x_q8 & 255;
    int32_t p[4];
    for (int i = 0; i < 4; i++) {
        const int at = x - 1 + i;
        p[i] = row[at < 0 ? 0 : (at >= width ? width - 1 : at)];
    }
    const int32_t cubic = 3 * (p[1] - p[2]) + p[3] - p[0];
    const int32_t square = 2 * p[0] - 5 * p[1] + 4 * p[2] - p[3];
    const int32_t inner = square * 256 + cubic * t;                // 1/256
    const int32_t middle = (p[2] - p[0]) * 256 + inner * t / 256;  // 1/256
    return p[1] * 16 + middle * t / (2 * 4096);
}

static int32_t slope_q1(const uint8_t *row, int width, int x) {
    const int before = x > 0 ? x - 1 : 0;
    const int after = x + 1 < width ? x + 1 : width - 1;
    return row[after] - row[before];
}

// Contribution of one pixel at its present disparity to the fit.
static struct moments moments_at(const struct work *work, int x, int y) {
    const uint8_t *left = image_u8_row(&work->input->left, y);
    const uint8_t *right = image_u8_row(&work->input->right, y);
    const int32_t x_right_q8 = x * 256 - disparity_row(work, y)[x];
    const int whole = x_right_q8 >> 8;
    if (reason_row(work, y)[x] != REASON_VALID || whole < 1 || whole + 2 >= work->width) {
        return (struct moments){0};
    }
    const int32_t t = x_right_q8 & 255;
    const int32_t right_slope = (slope_q1(right, work->width, whole) * (256 - t) +
                                 slope_q1(right, work->width, whole + 1) * t) /
                                256;
    const int32_t gradient = (slope_q1(left, work->width, x) + right_slope) / 2;
    const int32_t difference = sample_q4(right, work->width, x_right_q8) - left[x] * 16;
    return (struct moments){1,
                            gradient,
                            difference,
                            gradient * gradient,
                            gradient * difference,
                            difference * difference,
                            0};
}

static void add_moments(struct moments *sum, const struct moments *term, int sign) {
    sum->count += sign * term->count;
    sum->gradient += sign * term->gradient;
    sum->difference += sign * term->difference;
    sum->gradient2 += sign * term->gradient2;
    sum->product += sign * term->product;
    sum->difference2 += sign * term->difference2;
    sum->neighbours += sign * term->neighbours;
}

struct fit {
    int32_t move_q8;
    uint16_t variance_q16;  // bound, as smoothing leaves it
};

// Solves the window's normal equation with the prior that the present disparity is good: without
// texture nothing moves. The variance is without the prior, which shares its noise with the window.
static struct fit solve(const struct moments *sum) {
    struct fit result = {0, BOUND_MAX_Q16};
    const int64_t count = sum->count;
    if (count < WINDOW_ROWS) {
        return result;
    }
    // Centred moments times count: gradient^2 in 1/4, product in 1/32, difference^2 in 1/256.
    const int64_t gg = count * sum->gradient2 - (int64_t)sum->gradient * sum->gradient;
    const int64_t gd = count * sum->product - (int64_t)sum->gradient * sum->difference;
    const int64_t dd = count * sum->difference2 - (int64_t)sum->difference * sum->difference;
    INVARIANT(gg >= 0 && dd >= 0);
    INVARIANT(gd < INT32_MAX && gd > -INT32_MAX);  // the square of gd fits into int64_t
    const int64_t explained = gg > 0 ? gd * gd / gg : 0;
    const int64_t left_over = dd > explained ? dd - explained : 0;
    // Variance of a difference in 1/256 grey level^2, at least that of rounding to grey levels.
    // Correlated differences (noise blurred by rectification, a surface that the window does not
    // follow) carry less information: with their covariance added, the variance is that of as many
    // independent ones.
    const int64_t together = count * sum->neighbours - (int64_t)sum->difference * sum->difference;
    const int64_t spread = left_over + (together > 0 ? together : 0);
    int64_t variance = spread / (count * (count - 2));
    variance = variance > ROUNDING_VARIANCE_Q8 ? variance : ROUNDING_VARIANCE_Q8;
    // Cramer-Rao bound of the window in (1/256 px)^2: noise over gradients that are not noise.
    const int64_t noise = count * variance * 1024;
    const int64_t texture = gg - ((count * noise) >> NOISE_GRADIENT_SHIFT);
    if (noise < BOUND_SHARE * BOUND_MAX_Q16 * texture) {
        result.variance_q16 = (uint16_t)(noise / (BOUND_SHARE * texture));
    }
    const int64_t move_q8 = 32 * gd / (gg + (noise >> PRIOR_SHIFT));
    if (move_q8 <= MOVE_MAX_Q8 && move_q8 >= -MOVE_MAX_Q8) {
        result.move_q8 = (int32_t)move_q8;
    }
    return result;
}

static void fit_row(const struct work *work, const struct moments *column_sums, int y) {
    const uint8_t *reason = reason_row(work, y);
    const int32_t *present_q8 = disparity_row(work, y);
    int32_t *next_q8 = work->next_q8 + (ptrdiff_t)y * work->width;
    uint16_t *variance_q16 = image_u16_row(work->sigma_q8, y);
    struct moments sum = {0};
    for (int x = 0; x < RADIUS && x < work->width; x++) {
        add_moments(&sum, &column_sums[x], 1);
    }
    for (int x = 0; x < work->width; x++) {
        if (x + RADIUS < work->width) {
            add_moments(&sum, &column_sums[x + RADIUS], 1);
        }
        if (x - RADIUS - 1 >= 0) {
            add_moments(&sum, &column_sums[x - RADIUS - 1], -1);
        }
        next_q8[x] = present_q8[x];
        if (reason[x] == REASON_VALID) {
            const struct fit fit = solve(&sum);
            next_q8[x] += fit.move_q8;
            variance_q16[x] = fit.variance_q16;
        }
    }
}

static void band_rows(const struct work *work, int index, int *begin, int *end) {
    *begin = index * BAND_ROWS;
    *end = *begin + BAND_ROWS < work->height ? *begin + BAND_ROWS : work->height;
}

static void fit_band(const struct work *work, struct moments *ring, int begin, int end) {
    const size_t width = (size_t)work->width;
    struct moments *column_sums = ring + WINDOW_ROWS * width;
    memset(ring, 0, (WINDOW_ROWS + 1) * width * sizeof *ring);
    for (int arriving = begin - RADIUS; arriving < end + RADIUS; arriving++) {
        struct moments *row = ring + (size_t)((arriving + WINDOW_ROWS) % WINDOW_ROWS) * width;
        for (int x = 0; x < work->width; x++) {
            add_moments(&column_sums[x], &row[x], -1);
            row[x] = arriving >= 0 && arriving < work->height ? moments_at(work, x, arriving)
                                                              : (struct moments){0};
            row[x].neighbours = x > 0 ? row[x].difference * row[x - 1].difference : 0;
            add_moments(&column_sums[x], &row[x], 1);
        }
        if (arriving - RADIUS >= begin) {
            fit_row(work, column_sums, arriving - RADIUS);
        }
    }
}

// Disparities of a row, with UNUSED where there is no disparity (and beyond the ends), from index
// SMOOTH_RADIUS on.
static void masked_row(const struct work *work, int y, int32_t *masked_q8) {
    const int padded = work->width + 2 * SMOOTH_RADIUS;
    for (int x = 0; x < padded; x++) {
        masked_q8[x] = UNUSED_Q8;
    }
    if (y < 0 || y >= work->height) {
        return;
    }
    const int32_t *disparity_q8 = disparity_row(work, y);
    const uint8_t *reason = reason_row(work, y);
    for (int x = 0; x < work->width; x++) {
        masked_q8[x + SMOOTH_RADIUS] = reason[x] == REASON_VALID ? disparity_q8[x] : UNUSED_Q8;
    }
}

// Sums over the neighbours of each pixel of a row.
struct sums {
    int32_t *excess_q8, *count;
    int32_t *rough_q8;  // sums of |second differences|
};

// Adds one pair of opposite neighbours if both agree with the middle.
static void add_pair(const int32_t *restrict middle_q8, const int32_t *restrict one_q8,
                     const int32_t *restrict other_q8, int width, const struct sums *sums) {
    int32_t *restrict excess_q8 = sums->excess_q8;
    int32_t *restrict count = sums->count;
    int32_t *restrict rough_q8 = sums->rough_q8;
    for (int x = 0; x < width; x++) {
        const int32_t one = one_q8[x] - middle_q8[x];
        const int32_t other = other_q8[x] - middle_q8[x];
        const int32_t agree = one <= SMOOTH_STEP_Q8 && one >= -SMOOTH_STEP_Q8 &&
                                      other <= SMOOTH_STEP_Q8 && other >= -SMOOTH_STEP_Q8
                                  ? -1
                                  : 0;
        const int32_t both = (one + other) & agree;
        excess_q8[x] += both;
        count[x] -= 2 * agree;
        rough_q8[x] += both < 0 ? -both : both;
    }
}

// Sums over opposite pairs of neighbours: unbiased on any slope, also next to an edge.
static void sum_row(int32_t *const window[], int width, const struct sums *sums) {
    const int32_t *middle_q8 = window[SMOOTH_RADIUS] + SMOOTH_RADIUS;
    for (int x = 0; x < width; x++) {
        sums->excess_q8[x] = 0;
        sums->count[x] = 1;
        sums->rough_q8[x] = 0;
    }
    for (int j = 0; j <= SMOOTH_RADIUS; j++) {
        for (int i = j == 0 ? 1 : -SMOOTH_RADIUS; i <= SMOOTH_RADIUS; i++) {
            add_pair(middle_q8, window[SMOOTH_RADIUS + j] + SMOOTH_RADIUS + i,
                     window[SMOOTH_RADIUS - j] + SMOOTH_RADIUS - i, width, sums);
        }
    }
}

static uint16_t sigma_of(int32_t bound_q16, int32_t count, int32_t rough_q8, int32_t floor_q8) {
    const int32_t mean_q8 = count > 1 ? 2 * rough_q8 / (count - 1) : 0;
    const int32_t variance_q16 = bound_q16 + ROUGH_SHARE_Q4 * mean_q8 * mean_q8 / 16 +
                                 MISSING_Q16 * (SMOOTH_WINDOW * SMOOTH_WINDOW - count) +
                                 floor_q8 * floor_q8;
    const uint32_t sigma_q8 = (uint32_t)root_of(variance_q16);
    return (uint16_t)(sigma_q8 < SIGMA_MAX_Q8 ? sigma_q8 : SIGMA_MAX_Q8);
}

// The value, or the nearest of the limits +-max.
static int32_t at_most(int32_t value, int32_t max) {
    const int32_t below = value < max ? value : max;
    return below > -max ? below : -max;
}

static void smooth_row(const struct work *work, const struct sums *sums, int y) {
    const int32_t floor_q8 = work->input->resampled ? RESAMPLED_SIGMA_Q8 : FLOOR_SIGMA_Q8;
    const uint8_t *reason = reason_row(work, y);
    const int32_t *present_q8 = disparity_row(work, y);
    int32_t *next_q8 = work->next_q8 + (ptrdiff_t)y * work->width;
    for (int x = 0; x < work->width; x++) {
        next_q8[x] = present_q8[x];
        if (reason[x] == REASON_VALID) {
            const int32_t move_q8 = sums->excess_q8[x] / sums->count[x];
            next_q8[x] += at_most(move_q8, SMOOTH_MAX_Q8);
        }
    }
    uint16_t *sigma_q8 = image_u16_row(work->sigma_q8, y);
    for (int x = 0; work->predicts && x < work->width; x++) {
        sigma_q8[x] = reason[x] == REASON_VALID
                          ? sigma_of(sigma_q8[x], sums->count[x], sums->rough_q8[x], floor_q8)
                          : 0;
    }
}

static void smooth_part(void *context_pointer, int index) {
    const struct group_context *context = context_pointer;
    const struct work *work = context->work;
    const size_t padded = (size_t)work->width + 2 * SMOOTH_RADIUS;
    int32_t *scratch = work->rows_q8 + (size_t)index * SMOOTH_ROWS * padded;
    const struct sums sums = {scratch + SMOOTH_WINDOW * padded,
                              scratch + (SMOOTH_WINDOW + 1) * padded,
                              scratch + (SMOOTH_WINDOW + 2) * padded};
    for (int band = index; band < work->bands; band += context->groups) {
        int begin;
        int end;
        band_rows(work, band, &begin, &end);
        int32_t *window[SMOOTH_WINDOW];
        for (int j = 0; j < SMOOTH_WINDOW; j++) {
            window[j] = scratch + (size_t)j * padded;
            masked_row(work, begin + j - SMOOTH_RADIUS, window[j]);
        }
        for (int y = begin; y < end; y++) {
            sum_row(window, work->width, &sums);
            smooth_row(work, &sums, y);
            int32_t *oldest = window[0];
            memmove(window, window + 1, (SMOOTH_WINDOW - 1) * sizeof *window);
            window[SMOOTH_WINDOW - 1] = oldest;
            masked_row(work, y + 1 + SMOOTH_RADIUS, oldest);
        }
    }
}

static void take_over_part(void *context, int index) {
    const struct work *work = context;
    int begin;
    int end;
    band_rows(work, index, &begin, &end);
    for (int y = begin; y < end; y++) {
        memcpy(image_i32_row(&work->output->disparity_q8, y),
               work->next_q8 + (ptrdiff_t)y * work->width, (size_t)work->width * sizeof(int32_t));
    }
}

static void fit_part(void *context_pointer, int index) {
    const struct group_context *context = context_pointer;
    const struct work *work = context->work;
    struct moments *ring = work->columns + (size_t)index * (WINDOW_ROWS + 1) * (size_t)work->width;
    for (int band = index; band < work->bands; band += context->groups) {
        int begin;
        int end;
        band_rows(work, band, &begin, &end);
        fit_band(work, ring, begin, end);
    }
}

size_t subpixel_need_bytes(int width, int height, int threads) {
    const size_t pixels = (size_t)width * (size_t)height;
    return arena_need_bytes(pixels, sizeof(int32_t)) +
           arena_need_bytes((size_t)threads * (WINDOW_ROWS + 1) * (size_t)width,
                            sizeof(struct moments)) +
           arena_need_bytes((size_t)threads * SMOOTH_ROWS * ((size_t)width + 2 * SMOOTH_RADIUS),
                            sizeof(int32_t));
}

int subpixel_fit(const struct match_input *input, const struct parallel *parallel,
                 struct arena *arena, struct match_output *output, struct image_u16 *sigma_q8) {
    INVARIANT(parallel->threads >= 1);
    const size_t mark = arena_mark(arena);
    struct work work = {.input = input,
                        .output = output,
                        .sigma_q8 = sigma_q8,
                        .width = input->left.width,
                        .height = input->left.height};
    const size_t width = (size_t)work.width;
    work.next_q8 = arena_take(arena, width * (size_t)work.height, sizeof *work.next_q8);
    work.columns = arena_take(arena, (size_t)parallel->threads * (WINDOW_ROWS + 1) * width,
                              sizeof *work.columns);
    work.rows_q8 =
        arena_take(arena, (size_t)parallel->threads * SMOOTH_ROWS * (width + 2 * SMOOTH_RADIUS),
                   sizeof *work.rows_q8);
    if (work.next_q8 == NULL || work.columns == NULL || work.rows_q8 == NULL) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    work.bands = (work.height + BAND_ROWS - 1) / BAND_ROWS;
    struct group_context context = {&work, parallel->threads};
    for (int i = 0; i <= STEPS; i++) {
        work.predicts = i == STEPS;
        parallel->run(parallel->self, smooth_part, &context, context.groups);
        parallel->run(parallel->self, take_over_part, &work, work.bands);
        if (!work.predicts) {
            parallel->run(parallel->self, fit_part, &context, context.groups);
            parallel->run(parallel->self, take_over_part, &work, work.bands);
        }
    }
    arena_release(arena, mark);
    return ERROR_OK;
}

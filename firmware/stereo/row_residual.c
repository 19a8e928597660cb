// SPDX-License-Identifier: Apache-2.0
// Residual vertical disparity. Matches lie on one row by construction, so the true vertical offset
// must be measured: windows of a textured sample are aligned in both directions (Gauss-Newton on
// position, with the mean difference taken out), and offset and slopes are fitted to the vertical
// parts by reweighted least squares. Rows needed: ROW_RESIDUAL_AROUND above and below a sample, of
// the images; its own of disparities, which are final.
#include "stereo/row_residual.h"

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/image/reason.h"

enum {
    SAMPLES_MAX = 1024,
    SAMPLES_MIN = 50,
    STEP_MIN = 4,  // smallest step of the lattice, in pixels
    RADIUS = 4,    // half side of the window: 9x9
    SIDE = 2 * RADIUS + 1,
    WINDOW = SIDE * SIDE,
    REACH = 3,  // rows searched up and down
    MARGIN = RADIUS + REACH + 3,
    STEPS = 6,
    PIXEL_Q16 = 1 << 16,
    SETTLED_Q32 = 429497,          // square of the last move of an accepted position: 0.01 px
    SHIFT_MAX_Q16 = 2 << 16,       // along the row, from the match
    RISE_MAX_Q16 = 3 << 15,        // across the rows, from the best whole row
    GREY_BITS = 6,                 // fraction of resampled grey levels
    WEIGHT_ONE = 1 << 14,          // of the interpolation
    EIGENVALUE_MIN = 16 * WINDOW,  // (2 grey levels)^2 a pixel, of gradients that are doubled
};
_Static_assert((int)ROW_RESIDUAL_AROUND > (int)MARGIN, "no sample reads beyond the margin");

// Weights of cubic convolution (R. G. Keys, 1981) at t from the second of four values.
static void cubic_weights(int t_q14, int16_t weight_q14[4]) {
    const int t2 = (t_q14 * t_q14) >> 14;
    const int t3 = (t2 * t_q14) >> 14;
    weight_q14[0] = (int16_t)((2 * t2 - t_q14 - t3) >> 1);
    weight_q14[2] = (int16_t)((t_q14 + 4 * t2 - 3 * t3) >> 1);
    weight_q14[3] = (int16_t)((t3 - t2) >> 1);
    weight_q14[1] = (int16_t)(WEIGHT_ONE - weight_q14[0] - weight_q14[2] - weight_q14[3]);
}

// The window around (x, y): first along the rows, then along the columns.
static void window_at(const struct image_u8 *image, int x_q16, int y_q16,
                      int16_t window_q6[WINDOW]) {
    const int column = (x_q16 >> 16) - RADIUS - 1;
    const int row = (y_q16 >> 16) - RADIUS - 1;
    int16_t weight[4];
    cubic_weights((x_q16 & 0xffff) >> 2, weight);
    int16_t along_q6[SIDE + 3][SIDE];
    for (int j = 0; j < SIDE + 3; j++) {
        const uint8_t *from = image_u8_row(image, row + j) + column;
        int16_t p[SIDE + 3];
        for (int i = 0; i < SIDE + 3; i++) {
            p[i] = from[i];
        }
        for (int i = 0; i < SIDE; i++) {
            const int sum = weight[0] * p[i] + weight[1] * p[i + 1] + weight[2] * p[i + 2] +
                            weight[3] * p[i + 3];
            along_q6[j][i] = (int16_t)((sum + (1 << 7)) >> (14 - GREY_BITS));
        }
    }
    cubic_weights((y_q16 & 0xffff) >> 2, weight);
    for (int j = 0; j < SIDE; j++) {
        for (int i = 0; i < SIDE; i++) {
            const int sum = weight[0] * along_q6[j][i] + weight[1] * along_q6[j + 1][i] +
                            weight[2] * along_q6[j + 2][i] + weight[3] * along_q6[j + 3][i];
            window_q6[SIDE * j + i] = (int16_t)((sum + (1 << 13)) >> 14);
        }
    }
}

static int squared_difference(const struct match_input *input, int x, int y, int x_right,
                              int y_right) {
    int sum = 0;
    int sum2 = 0;
    for (int j = -RADIUS; j <= RADIUS; j++) {
        const uint8_t *left = image_u8_row(&input->left, y + j) + x;
        const uint8_t *right = image_u8_row(&input->right, y_right + j) + x_right;
        for (int i = -RADIUS; i <= RADIUS; i++) {
            const int16_t difference = (int16_t)(left[i] - right[i]);
            sum += difference;
            sum2 += difference * difference;
        }
    }
    return sum2 * WINDOW - sum * sum;
}

// A window of the left image, its gradients, doubled, with their sums, and the inverse of their
// structure tensor.
struct target {
    int16_t grey[WINDOW], gx[WINDOW], gy[WINDOW];
    int sum_x, sum_y;
    int inverse_xx_q40, inverse_xy_q40, inverse_yy_q40;
};

// Returns false if either direction has too little texture.
static bool cut_target(const struct image_u8 *left, int x, int y, struct target *target) {
    int xx = 0, xy = 0, yy = 0;
    target->sum_x = 0;
    target->sum_y = 0;
    for (int j = 0; j < SIDE; j++) {
        const uint8_t *above = image_u8_row(left, y + j - RADIUS - 1) + x - RADIUS;
        const uint8_t *row = image_u8_row(left, y + j - RADIUS) + x - RADIUS;
        const uint8_t *below = image_u8_row(left, y + j - RADIUS + 1) + x - RADIUS;
        for (int i = 0; i < SIDE; i++) {
            const int16_t gx = (int16_t)(row[i + 1] - row[i - 1]);
            const int16_t gy = (int16_t)(below[i] - above[i]);
            target->grey[SIDE * j + i] = (int16_t)(row[i] << GREY_BITS);
            target->gx[SIDE * j + i] = gx;
            target->gy[SIDE * j + i] = gy;
            target->sum_x += gx;
            target->sum_y += gy;
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
        }
    }
    // The least eigenvalue is above the limit if the tensor less the limit is positive definite.
    const int over_x = xx - EIGENVALUE_MIN, over_y = yy - EIGENVALUE_MIN;
    if (over_x <= 0 || over_y <= 0 || (int64_t)over_x * over_y <= (int64_t)xy * xy) {
        return false;
    }
    // Four digits: the inverse decides how fast positions converge, not where.
    const int64_t determinant = (int64_t)xx * yy - (int64_t)xy * xy;
    INVARIANT(determinant > 0);
    const int shift = 48 - __builtin_clzll((unsigned long long)determinant);
    const int reciprocal = (int)((1U << 31) / (uint32_t)(determinant >> shift));
    target->inverse_xx_q40 = (int)(((int64_t)yy * reciprocal * (1 << 9)) >> shift);
    target->inverse_xy_q40 = (int)(-((int64_t)xy * reciprocal * (1 << 9)) >> shift);
    target->inverse_yy_q40 = (int)(((int64_t)xx * reciprocal * (1 << 9)) >> shift);
    return true;
}

static bool inside(const struct match_input *input, int x_q16, int y) {
    return x_q16 >= MARGIN * PIXEL_Q16 && y >= MARGIN &&
           x_q16 < (input->right.width - MARGIN) * PIXEL_Q16 && y < input->right.height - MARGIN;
}

// The step of Gauss and Newton from a window of the right image.
static void find_move(const struct target *target, const int16_t window_q6[WINDOW], int64_t *x_q16,
                      int64_t *y_q16) {
    int bx = 0, by = 0, sum = 0;
    for (int i = 0; i < WINDOW; i++) {
        const int16_t difference = (int16_t)(window_q6[i] - target->grey[i]);
        bx += target->gx[i] * difference;
        by += target->gy[i] * difference;
        sum += difference;
    }
    const int mean_q14 = sum * (1 << 8) / WINDOW;
    const int64_t rest_x = bx - (((int64_t)target->sum_x * mean_q14) >> 8);
    const int64_t rest_y = by - (((int64_t)target->sum_y * mean_q14) >> 8);
    // Gradients and their products are 2 and 4 times what they stand for.
    enum { SHIFT = 40 + GREY_BITS - 1 - 16 };
    *x_q16 = -(target->inverse_xx_q40 * rest_x + target->inverse_xy_q40 * rest_y) >> SHIFT;
    *y_q16 = -(target->inverse_xy_q40 * rest_x + target->inverse_yy_q40 * rest_y) >> SHIFT;
}

static bool is_below(int64_t value, int limit) {
    return value < limit && value > -limit;
}

// Aligns the window at (x, y) with the right image near (x_right, y + start). The gradient is that
// of the left window, so its tensor serves all steps. Returns false if it does not converge.
static bool align(const struct image_u8 *right, const struct target *target, int x_right_q16, int y,
                  int start, int *vertical_q16) {
    INVARIANT(start > -REACH && start < REACH);
    int dx_q16 = 0;
    int dy_q16 = 0;  // from `start`
    int64_t last_q32 = INT64_MAX;
    for (int step = 0; step < STEPS && last_q32 >= SETTLED_Q32; step++) {
        int16_t window_q6[WINDOW];
        window_at(right, x_right_q16 + dx_q16, (y + start) * PIXEL_Q16 + dy_q16, window_q6);
        int64_t move_x, move_y;
        find_move(target, window_q6, &move_x, &move_y);
        if (!is_below(dx_q16 + move_x, SHIFT_MAX_Q16) || !is_below(dy_q16 + move_y, RISE_MAX_Q16)) {
            return false;
        }
        dx_q16 += (int)move_x;
        dy_q16 += (int)move_y;
        last_q32 = move_x * move_x + move_y * move_y;
    }
    *vertical_q16 = start * PIXEL_Q16 + dy_q16;
    return last_q32 < SETTLED_Q32;
}

static bool measure(const struct match_input *input, const struct match_output *output, int x,
                    int y, int *vertical_q16) {
    const int x_right_q16 = x * PIXEL_Q16 - image_i32_row(&output->disparity_q8, y)[x] * 256;
    struct target target;
    if (!inside(input, x_right_q16, y) || !inside(input, x * PIXEL_Q16, y) ||
        !cut_target(&input->left, x, y, &target)) {
        return false;
    }
    const int nearest = (x_right_q16 + PIXEL_Q16 / 2) >> 16;
    int best = 0;
    int lowest = INT32_MAX;
    for (int dy = -REACH; dy <= REACH; dy++) {
        const int cost = squared_difference(input, x, y, nearest, y + dy);
        if (cost < lowest) {
            lowest = cost;
            best = dy;
        }
    }
    // A minimum at the end of the search is not valid.
    if (best == REACH || best == -REACH) {
        return false;
    }
    return align(&input->right, &target, x_right_q16, y, best, vertical_q16) &&
           is_below(*vertical_q16, REACH * PIXEL_Q16);
}

// Adds the textured matches of the lattice's rows below `end`; at most SAMPLES_MAX.
static void sample_rows(struct row_residual *residual, int end) {
    const struct match_input *input = residual->input;
    const int step = residual->step;
    const int middle_x = input->left.width / 2 / step;
    const int middle_y = input->left.height / 2 / step;
    for (; residual->next_y < end; residual->next_y += step) {
        const int y = residual->next_y;
        const uint8_t *reason = image_u8_row(&residual->output->reason, y);
        for (int x = step / 2; x < input->left.width && residual->count < SAMPLES_MAX; x += step) {
            int vertical_q16;
            if (reason[x] == REASON_VALID &&
                measure(input, residual->output, x, y, &vertical_q16)) {
                residual->samples[residual->count++] = (struct row_sample){
                    .x = (int16_t)(x / step - middle_x),
                    .y = (int16_t)(y / step - middle_y),
                    .vertical_q12 = (int16_t)((vertical_q16 + 8) >> 4),
                };
            }
        }
    }
}

static void begin_lattice(struct row_residual *residual, int step) {
    INVARIANT(step >= STEP_MIN);
    residual->step = step;
    residual->next_y = step / 2;
    residual->count = 0;
}

int row_residual_begin(struct row_residual *residual, const struct match_input *input,
                       const struct match_output *output, struct arena *arena) {
    *residual = (struct row_residual){.input = input, .output = output};
    residual->samples = arena_take(arena, SAMPLES_MAX, sizeof *residual->samples);
    residual->work = arena_take(arena, SAMPLES_MAX, sizeof *residual->work);
    // A lattice of at most SAMPLES_MAX positions over the image.
    int step = STEP_MIN;
    while ((int64_t)(input->left.width / step + 1) * (input->left.height / step + 1) >
           SAMPLES_MAX) {
        step++;
    }
    begin_lattice(residual, step);
    return residual->samples != NULL && residual->work != NULL ? ERROR_OK : ERROR_MEMORY;
}

void row_residual_add(struct row_residual *residual, int rows) {
    const int height = residual->input->left.height;
    INVARIANT(rows >= 0 && residual->next_y >= residual->step / 2);
    sample_rows(residual, rows < height ? rows - ROW_RESIDUAL_AROUND : height);
}

// A finer lattice if little of the image has texture, for example an object in front of a wall out
// of focus.
static void sample_finer(struct row_residual *residual) {
    const int height = residual->input->left.height;
    while (residual->count < SAMPLES_MIN && residual->step > STEP_MIN) {
        begin_lattice(residual, residual->step / 2 > STEP_MIN ? residual->step / 2 : STEP_MIN);
        while (residual->next_y < height) {
            match_input_rows(residual->input, MATCH_WANTS_GREY,
                             residual->next_y - ROW_RESIDUAL_AROUND,
                             residual->next_y + ROW_RESIDUAL_AROUND);
            sample_rows(residual, residual->next_y + 1);
        }
    }
}

void row_residual_finish(struct row_residual *residual, struct triangulate_vertical *vertical) {
    sample_finer(residual);
    const int count = residual->count;
    *vertical = (struct triangulate_vertical){.samples = count >= SAMPLES_MIN ? count : 0};
    if (count < SAMPLES_MIN) {
        return;
    }
    struct row_trend trend;
    row_trend_fit(residual->samples, count, residual->work, &trend);
    const int step = residual->step;
    vertical->slope_x = trend.plane_px[1] / step;
    vertical->slope_y = trend.plane_px[2] / step;
    // From the lattice's middle to the image's.
    const struct image_u8 *left = &residual->input->left;
    vertical->offset_px = trend.plane_px[0] +
                          vertical->slope_x * (left->width / 2 % step - step / 2) +
                          vertical->slope_y * (left->height / 2 % step - step / 2);
    vertical->rms_px = trend.scatter_px;
    vertical->median_px = trend.median_px;
    vertical->p95_px = trend.p95_px;
    vertical->trend_px = trend.plane_p95_px;
    vertical->curve_px = trend.curve_p95_px;
}

size_t row_residual_need_bytes(void) {
    return arena_need_bytes(SAMPLES_MAX, sizeof(struct row_sample)) +
           arena_need_bytes(SAMPLES_MAX, sizeof(int16_t));
}

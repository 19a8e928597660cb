// SPDX-License-Identifier: Apache-2.0
// Residual vertical disparity. Matches lie on one row by construction, so the true vertical offset
// must be measured: windows of a textured sample are aligned in both directions (Gauss-Newton on
// position, with the mean difference taken out), and offset and slopes are fitted to the vertical
// parts by reweighted least squares. Rows needed: ROW_RESIDUAL_AROUND above and below a sample, of
// the images; its own of disparities, which are final.
#include "stereo/row_residual.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/order.h"
#include "stereo/image/reason.h"

enum {
    SAMPLES_MAX = 4096,
    SAMPLES_MIN = 50,
    STEP_MIN = 4,  // smallest step of the lattice, in pixels
    RADIUS = 4,    // half side of the window: 9x9
    REACH = 3,     // rows searched up and down
    MARGIN = RADIUS + REACH + 3,
    STEPS = 6,
    FIT_ROUNDS = 10,
    PLANE_TERMS = 3,
    SURFACE_MAX_TERMS = 6,
    WINDOW = (2 * RADIUS + 1) * (2 * RADIUS + 1),
};
_Static_assert((int)ROW_RESIDUAL_AROUND > (int)MARGIN, "no sample reads beyond the margin");

// Cubic convolution (R. G. Keys, 1981) between p1 and p2, at t from p1.
static double between(double p0, double p1, double p2, double p3, double t) {
    return p1 + 0.5 * t *
                    (p2 - p0 +
                     t * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + t * (3.0 * (p1 - p2) + p3 - p0)));
}

// The window around (x, y): first along the rows, then along the columns.
static void window_at(const struct image_u8 *image, double x, double y,
                      double window[2 * RADIUS + 1][2 * RADIUS + 1]) {
    const int column = (int)x - RADIUS;
    const int row = (int)y - RADIUS;
    const double tx = x - (int)x;
    const double ty = y - (int)y;
    double along[2 * RADIUS + 4][2 * RADIUS + 1];
    for (int j = 0; j < 2 * RADIUS + 4; j++) {
        const uint8_t *p = image_u8_row(image, row - 1 + j) + column - 1;
        for (int i = 0; i < 2 * RADIUS + 1; i++) {
            along[j][i] = between(p[i], p[i + 1], p[i + 2], p[i + 3], tx);
        }
    }
    for (int j = 0; j < 2 * RADIUS + 1; j++) {
        for (int i = 0; i < 2 * RADIUS + 1; i++) {
            window[j][i] =
                between(along[j][i], along[j + 1][i], along[j + 2][i], along[j + 3][i], ty);
        }
    }
}

// Square of a move that is too small to matter.
static const double CONVERGED_PX2 = 1e-8;

static int64_t squared_difference(const struct match_input *input, int x, int y, int x_right,
                                  int y_right) {
    int64_t sum = 0;
    int64_t sum2 = 0;
    for (int j = -RADIUS; j <= RADIUS; j++) {
        const uint8_t *left = image_u8_row(&input->left, y + j) + x;
        const uint8_t *right = image_u8_row(&input->right, y_right + j) + x_right;
        for (int i = -RADIUS; i <= RADIUS; i++) {
            const int difference = left[i] - right[i];
            sum += difference;
            sum2 += difference * difference;
        }
    }
    return sum2 * WINDOW - sum * sum;
}

// Structure tensor of the left window, centred; false if either direction has too little texture.
static bool textured(const struct match_input *input, int x, int y, double tensor[3]) {
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    for (int j = -RADIUS; j <= RADIUS; j++) {
        const uint8_t *above = image_u8_row(&input->left, y + j - 1) + x;
        const uint8_t *row = image_u8_row(&input->left, y + j) + x;
        const uint8_t *below = image_u8_row(&input->left, y + j + 1) + x;
        for (int i = -RADIUS; i <= RADIUS; i++) {
            const double gx = 0.5 * (row[i + 1] - row[i - 1]);
            const double gy = 0.5 * (below[i] - above[i]);
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
        }
    }
    tensor[0] = xx;
    tensor[1] = xy;
    tensor[2] = yy;
    // Least eigenvalue of the tensor against 4 grey levels^2 a pixel.
    const double half_trace = 0.5 * (xx + yy);
    const double spread = sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
    return half_trace - spread > 4.0 * WINDOW;
}

static bool inside(const struct match_input *input, double x, double y) {
    return x >= MARGIN && y >= MARGIN && x < input->right.width - MARGIN &&
           y < input->right.height - MARGIN;
}

// Aligns the window at (x, y) with the right image near (x_right, y + start). The gradient is that
// of the left window, so its tensor serves all steps. Returns false if it does not converge.
static bool align(const struct match_input *input, int x, int y, double x_right, double start,
                  const double tensor[3], double *vertical_px) {
    const double determinant = tensor[0] * tensor[2] - tensor[1] * tensor[1];
    double dx = 0.0;
    double dy = start;
    double last = 1.0;
    for (int step = 0; step < STEPS && last > CONVERGED_PX2; step++) {
        double window[2 * RADIUS + 1][2 * RADIUS + 1];
        window_at(&input->right, x_right + dx, y + dy, window);
        double bx = 0.0;
        double by = 0.0;
        double mean = 0.0;
        double sum_x = 0.0;
        double sum_y = 0.0;
        for (int j = -RADIUS; j <= RADIUS; j++) {
            const uint8_t *row = image_u8_row(&input->left, y + j) + x;
            const uint8_t *above = image_u8_row(&input->left, y + j - 1) + x;
            const uint8_t *below = image_u8_row(&input->left, y + j + 1) + x;
            for (int i = -RADIUS; i <= RADIUS; i++) {
                const double gx = 0.5 * (row[i + 1] - row[i - 1]);
                const double gy = 0.5 * (below[i] - above[i]);
                const double difference = window[RADIUS + j][RADIUS + i] - row[i];
                bx += gx * difference;
                by += gy * difference;
                mean += difference;
                sum_x += gx;
                sum_y += gy;
            }
        }
        bx -= sum_x * mean / WINDOW;
        by -= sum_y * mean / WINDOW;
        const double move_x = -(tensor[2] * bx - tensor[1] * by) / determinant;
        const double move_y = -(tensor[0] * by - tensor[1] * bx) / determinant;
        dx += move_x;
        dy += move_y;
        last = move_x * move_x + move_y * move_y;
        if (!(dx * dx < 4.0 && (dy - start) * (dy - start) < 2.25)) {
            return false;
        }
    }
    *vertical_px = dy;
    return last < 0.01 * 0.01;
}

static bool measure(const struct match_input *input, const struct match_output *output, int x,
                    int y, double *vertical_px) {
    const double x_right = x - image_i32_row(&output->disparity_q8, y)[x] / 256.0;
    double tensor[3];
    if (!inside(input, x_right, y) || !inside(input, x, y) || !textured(input, x, y, tensor)) {
        return false;
    }
    const int nearest = (int)(x_right + 0.5);
    int best = 0;
    int64_t lowest = INT64_MAX;
    for (int dy = -REACH; dy <= REACH; dy++) {
        const int64_t cost = squared_difference(input, x, y, nearest, y + dy);
        if (cost < lowest) {
            lowest = cost;
            best = dy;
        }
    }
    // A minimum at the end of the search is not valid.
    if (best == REACH || best == -REACH) {
        return false;
    }
    return align(input, x, y, x_right, best, tensor, vertical_px) && *vertical_px > -REACH &&
           *vertical_px < REACH;
}

// A polynomial over the image: offset, slopes, and with SURFACE_MAX_TERMS its curvature and twist.
struct surface {
    int terms, width, height;
    double factor[SURFACE_MAX_TERMS];
};

static void basis_at(const struct surface *surface, const struct row_residual_sample *sample,
                     double basis[SURFACE_MAX_TERMS]) {
    const double u = (sample->x - surface->width / 2) / (double)surface->width;
    const double v = (sample->y - surface->height / 2) / (double)surface->height;
    basis[0] = 1.0;
    basis[1] = u;
    basis[2] = v;
    basis[3] = u * u;
    basis[4] = u * v;
    basis[5] = v * v;
}

static double value_of(const struct surface *surface, const struct row_residual_sample *sample) {
    double basis[SURFACE_MAX_TERMS];
    basis_at(surface, sample, basis);
    INVARIANT(surface->terms <= SURFACE_MAX_TERMS);
    double value = 0.0;
    for (int i = 0; i < surface->terms; i++) {
        value += surface->factor[i] * basis[i];
    }
    return value;
}

struct normal_equations {
    double a[SURFACE_MAX_TERMS][SURFACE_MAX_TERMS], b[SURFACE_MAX_TERMS];
};

// Solves a symmetric system of equations by elimination, overwriting it; false if it is close to
// singular.
static bool solve(struct normal_equations *n, int terms, double result[SURFACE_MAX_TERMS]) {
    double share = 1.0;
    for (int i = 0; i < terms; i++) {
        const double diagonal = n->a[i][i];
        for (int k = 0; k < i; k++) {
            const double factor = n->a[i][k] / n->a[k][k];
            for (int j = k; j < terms; j++) {
                n->a[i][j] -= factor * n->a[k][j];
            }
            n->b[i] -= factor * n->b[k];
        }
        share *= n->a[i][i] / diagonal;
        if (!(diagonal > 0.0 && share > 1e-9)) {
            return false;
        }
    }
    for (int i = terms - 1; i >= 0; i--) {
        double rest = n->b[i];
        for (int j = i + 1; j < terms; j++) {
            rest -= n->a[i][j] * result[j];
        }
        result[i] = rest / n->a[i][i];
    }
    return true;
}

static double magnitude(double value) {
    return value < 0.0 ? -value : value;
}

static double quantile(float *work, int count, double share) {
    return (double)order_statistic(work, count, (int)(share * (count - 1)));
}

// Reweighted least squares with Cauchy weights; its scale is the residuals' median. Returns that
// scale.
static double fit(const struct row_residual_sample *samples, int count, float *work,
                  struct surface *surface) {
    for (int i = 0; i < count; i++) {
        work[i] = samples[i].vertical_px;
    }
    surface->factor[0] = quantile(work, count, 0.5);
    double scale = 0.0;
    for (int round = 0; round < FIT_ROUNDS; round++) {
        for (int i = 0; i < count; i++) {
            work[i] = (float)magnitude(samples[i].vertical_px - value_of(surface, &samples[i]));
        }
        scale = 1.4826 * quantile(work, count, 0.5) + 1e-3;
        struct normal_equations n = {{{0}}, {0}};
        for (int i = 0; i < count; i++) {
            const double r =
                (samples[i].vertical_px - value_of(surface, &samples[i])) / (2 * scale);
            const double weight = 1.0 / (1.0 + r * r);
            double basis[SURFACE_MAX_TERMS];
            basis_at(surface, &samples[i], basis);
            for (int j = 0; j < surface->terms; j++) {
                for (int k = 0; k < surface->terms; k++) {
                    n.a[j][k] += weight * basis[j] * basis[k];
                }
                n.b[j] += weight * basis[j] * (double)samples[i].vertical_px;
            }
        }
        double solution[SURFACE_MAX_TERMS];
        if (!solve(&n, surface->terms, solution)) {
            break;
        }
        for (int j = 0; j < surface->terms; j++) {
            surface->factor[j] = solution[j];
        }
    }
    return scale;
}

// The model that triangulation subtracts, and how large it and its curvature are at the samples.
static void fit_trend(const struct row_residual_sample *samples, int count, int width, int height,
                      float *work, struct triangulate_vertical *vertical) {
    struct surface plane = {.terms = PLANE_TERMS, .width = width, .height = height};
    vertical->rms_px = fit(samples, count, work, &plane);
    vertical->offset_px = plane.factor[0];
    vertical->slope_x = plane.factor[1] / width;
    vertical->slope_y = plane.factor[2] / height;
    struct surface curved = {.terms = SURFACE_MAX_TERMS, .width = width, .height = height};
    (void)fit(samples, count, work, &curved);
    for (int i = 0; i < count; i++) {
        work[i] = (float)magnitude(value_of(&plane, &samples[i]));
    }
    vertical->trend_px = quantile(work, count, 0.95);
    for (int i = 0; i < count; i++) {
        work[i] = (float)magnitude(value_of(&curved, &samples[i]) - value_of(&plane, &samples[i]));
    }
    vertical->curve_px = quantile(work, count, 0.95);
}

// Adds the textured matches of the lattice's rows below `end`; at most SAMPLES_MAX.
static void sample_rows(struct row_residual *residual, int end) {
    const struct match_input *input = residual->input;
    for (; residual->next_y < end; residual->next_y += residual->step) {
        const int y = residual->next_y;
        const uint8_t *reason = image_u8_row(&residual->output->reason, y);
        for (int x = residual->step / 2; x < input->left.width && residual->count < SAMPLES_MAX;
             x += residual->step) {
            double vertical_px;
            if (reason[x] == REASON_VALID && measure(input, residual->output, x, y, &vertical_px)) {
                residual->samples[residual->count++] =
                    (struct row_residual_sample){(int16_t)x, (int16_t)y, (float)vertical_px};
            }
        }
    }
}

static void begin_lattice(struct row_residual *residual, int step) {
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
    float *work = residual->work;
    for (int i = 0; i < count; i++) {
        work[i] = (float)magnitude((double)residual->samples[i].vertical_px);
    }
    vertical->median_px = quantile(work, count, 0.5);
    vertical->p95_px = quantile(work, count, 0.95);
    fit_trend(residual->samples, count, residual->input->left.width, residual->input->left.height,
              work, vertical);
}

size_t row_residual_need_bytes(void) {
    return arena_need_bytes(SAMPLES_MAX, sizeof(struct row_residual_sample)) +
           arena_need_bytes(SAMPLES_MAX, sizeof(float));
}

// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/sparse_align.h"

#include <math.h>
#include <string.h>

#include "core/cholesky.h"
#include "core/invariant.h"

enum {
    RADIUS = 7,  // half side of the window
    WINDOW = (2 * RADIUS + 1) * (2 * RADIUS + 1),
    STEPS = 10,
};

// Surfaces are rather seen straight than aslant: weight of that, of what the shift along x has.
static const double straightness = 0.02;
static const double bend_max_px = 2;  // largest change of the shift from the middle to the edge

static double value_at(const struct image_u8 *image, double x, double y) {
    const int ix = (int)x, iy = (int)y;
    const double tx = x - ix, ty = y - iy;
    INVARIANT(ix >= 0 && ix + 1 < image->width && iy >= 0 && iy + 1 < image->height);
    const uint8_t *a = image_u8_row(image, iy) + ix, *b = a + image->stride;
    return (1 - ty) * (a[0] + tx * (a[1] - a[0])) + ty * (b[0] + tx * (b[1] - b[0]));
}

// What differs between the windows: a shift along x and y, and of that along x how it grows with x
// and y, as on a surface that is seen aslant.
enum shape { SHIFT_X, SHIFT_Y, STRETCH, SHEAR, SHAPE };

// A window of the left picture with its derivatives, without their means.
struct window {
    float value[WINDOW], slope[SHAPE][WINDOW];
    double normal[SHAPE][SHAPE], square;
};

static double product(const float *a, const float *b) {
    float sum = 0;
    for (int n = 0; n < WINDOW; n++) {
        sum += a[n] * b[n];
    }
    return (double)sum;
}

static void subtract_mean(float *values) {
    float sum = 0;
    for (int n = 0; n < WINDOW; n++) {
        sum += values[n];
    }
    for (int n = 0; n < WINDOW; n++) {
        values[n] -= sum / WINDOW;
    }
}

static void take_window(const struct image_u8 *image, double x, double y, struct window *w) {
    // Side of the window with the neighbours that the gradients need.
    enum { SIDE = 2 * RADIUS + 3 };
    double value[SIDE][SIDE];
    for (int j = 0; j < SIDE; j++) {
        for (int i = 0; i < SIDE; i++) {
            value[j][i] = value_at(image, x + i - RADIUS - 1, y + j - RADIUS - 1);
        }
    }
    int n = 0;
    for (int j = 1; j < SIDE - 1; j++) {
        for (int i = 1; i < SIDE - 1; i++, n++) {
            const float gx = (float)(0.5 * (value[j][i + 1] - value[j][i - 1]));
            w->value[n] = (float)value[j][i];
            w->slope[SHIFT_X][n] = gx;
            w->slope[SHIFT_Y][n] = (float)(0.5 * (value[j + 1][i] - value[j - 1][i]));
            w->slope[STRETCH][n] = gx * (float)(i - RADIUS - 1) / RADIUS;
            w->slope[SHEAR][n] = gx * (float)(j - RADIUS - 1) / RADIUS;
        }
    }
    subtract_mean(w->value);
    w->square = product(w->value, w->value);
    for (int a = 0; a < SHAPE; a++) {
        subtract_mean(w->slope[a]);
    }
    for (int a = 0; a < SHAPE; a++) {
        for (int b = 0; b < SHAPE; b++) {
            w->normal[a][b] = product(w->slope[a], w->slope[b]);
        }
    }
}

static bool is_inside(const struct image_u8 *image, double x, double y) {
    const double margin = RADIUS + 2 + 2 * bend_max_px;
    return x >= margin && y >= margin && x < image->width - 1 - margin &&
           y < image->height - 1 - margin;
}

// The right window at a shape: values without their mean.
static void sample(const struct image_u8 *image, const double shape[SHAPE], float value[WINDOW]) {
    int n = 0;
    for (int j = -RADIUS; j <= RADIUS; j++) {
        for (int i = -RADIUS; i <= RADIUS; i++, n++) {
            const double bend = (shape[STRETCH] * i + shape[SHEAR] * j) / RADIUS;
            value[n] = (float)value_at(image, shape[SHIFT_X] + i + bend, shape[SHIFT_Y] + j);
        }
    }
    subtract_mean(value);
}

// Factors of the normal equations with what is known beforehand; false if the shift is not
// determined.
static bool factorize(const struct window *w, double weight, double factor[SHAPE][SHAPE]) {
    const double xx = w->normal[SHIFT_X][SHIFT_X], yy = w->normal[SHIFT_Y][SHIFT_Y];
    const double xy = w->normal[SHIFT_X][SHIFT_Y];
    memcpy(factor, w->normal, sizeof w->normal);
    factor[STRETCH][STRETCH] += weight;
    factor[SHEAR][SHEAR] += weight;
    cholesky_factorize(&factor[0][0], SHAPE, 1e-6);
    return xx * yy - xy * xy > 1e-3 * xx * yy;
}

// The change of the shape by a window whose values at the present one are given; they become the
// difference. Returns how alike the windows are.
static double improve(const struct window *w, double factor[SHAPE][SHAPE], double weight,
                      float value[WINDOW], const double shape[SHAPE], double change[SHAPE]) {
    const double square = product(value, value);
    const double alike = product(value, w->value) / sqrt(square * w->square + 1e-9);
    const float gain = square > 0 ? (float)sqrt(w->square / square) : 1;
    for (int n = 0; n < WINDOW; n++) {
        value[n] = w->value[n] - gain * value[n];
    }
    for (int a = 0; a < SHAPE; a++) {
        change[a] = product(w->slope[a], value);
    }
    change[STRETCH] -= weight * shape[STRETCH];
    change[SHEAR] -= weight * shape[SHEAR];
    cholesky_forward(&factor[0][0], SHAPE, change, 1);
    cholesky_backward(&factor[0][0], SHAPE, change);
    return alike;
}

// Moves (x, y) to the best agreement with the window; brightness and contrast may differ. Returns
// false if it does not converge near the start or the windows are not alike.
static bool align(const struct window *w, const struct image_u8 *image, double px[2]) {
    static const double away_max_px = 4, alike_min = 0.85;
    const double weight = straightness * w->normal[SHIFT_X][SHIFT_X];
    double shape[SHAPE] = {px[0], px[1], 0, 0}, factor[SHAPE][SHAPE], change[SHAPE];
    INVARIANT(w->square >= 0 && weight >= 0);
    if (!factorize(w, weight, factor)) {
        return false;
    }
    for (int round = 0; round < STEPS; round++) {
        float value[WINDOW];
        if (!is_inside(image, shape[SHIFT_X], shape[SHIFT_Y])) {
            return false;
        }
        sample(image, shape, value);
        const double alike = improve(w, factor, weight, value, shape, change);
        for (int a = 0; a < SHAPE; a++) {
            shape[a] += change[a];
        }
        const double away_x = shape[SHIFT_X] - px[0], away_y = shape[SHIFT_Y] - px[1];
        const double bend = shape[STRETCH] * shape[STRETCH] + shape[SHEAR] * shape[SHEAR];
        if (!(away_x * away_x + away_y * away_y < away_max_px * away_max_px &&
              bend < bend_max_px * bend_max_px)) {
            return false;
        }
        if (change[SHIFT_X] * change[SHIFT_X] + change[SHIFT_Y] * change[SHIFT_Y] < 1e-4) {
            px[0] = shape[SHIFT_X];
            px[1] = shape[SHIFT_Y];
            return alike > alike_min;
        }
    }
    return false;
}

bool sparse_align(const struct image_u8 *left, double x, double y, const struct image_u8 *right,
                  double right_px[2]) {
    struct window window;
    if (!is_inside(left, x, y)) {
        return false;
    }
    take_window(left, x, y, &window);
    return align(&window, right, right_px);
}

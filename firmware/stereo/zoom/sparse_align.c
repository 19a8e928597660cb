// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/sparse_align.h"

#include <math.h>

#include "core/invariant.h"

enum {
    RADIUS = 7,  // of the window
    WINDOW = (2 * RADIUS + 1) * (2 * RADIUS + 1),
    STEPS = 10,
};

static double value_at(const struct image_u8 *image, double x, double y) {
    const int ix = (int)x, iy = (int)y;
    const double tx = x - ix, ty = y - iy;
    INVARIANT(ix >= 0 && ix + 1 < image->width && iy >= 0 && iy + 1 < image->height);
    const uint8_t *a = image_u8_row(image, iy) + ix, *b = a + image->stride;
    return (1 - ty) * (a[0] + tx * (a[1] - a[0])) + ty * (b[0] + tx * (b[1] - b[0]));
}

// A window of the left picture with its gradients, without their means.
struct window {
    float value[WINDOW], gx[WINDOW], gy[WINDOW];
    double xx, xy, yy, square;
};

static void take_window(const struct image_u8 *image, double x, double y, struct window *w) {
    enum { SIDE = 2 * RADIUS + 3 };  // with the neighbours that the gradients need
    double value[SIDE][SIDE], mean = 0, mean_x = 0, mean_y = 0;
    for (int j = 0; j < SIDE; j++) {
        for (int i = 0; i < SIDE; i++) {
            value[j][i] = value_at(image, x + i - RADIUS - 1, y + j - RADIUS - 1);
        }
    }
    int n = 0;
    for (int j = 1; j < SIDE - 1; j++) {
        for (int i = 1; i < SIDE - 1; i++, n++) {
            const double gx = 0.5 * (value[j][i + 1] - value[j][i - 1]);
            const double gy = 0.5 * (value[j + 1][i] - value[j - 1][i]);
            w->value[n] = (float)value[j][i];
            w->gx[n] = (float)gx;
            w->gy[n] = (float)gy;
            mean += value[j][i];
            mean_x += gx;
            mean_y += gy;
        }
    }
    w->xx = w->xy = w->yy = w->square = 0;
    for (n = 0; n < WINDOW; n++) {
        w->value[n] -= (float)(mean / WINDOW);
        w->gx[n] -= (float)(mean_x / WINDOW);
        w->gy[n] -= (float)(mean_y / WINDOW);
        w->xx += (double)(w->gx[n] * w->gx[n]);
        w->xy += (double)(w->gx[n] * w->gy[n]);
        w->yy += (double)(w->gy[n] * w->gy[n]);
        w->square += (double)(w->value[n] * w->value[n]);
    }
}

static bool is_inside(const struct image_u8 *image, double x, double y) {
    const double margin = RADIUS + 2;
    return x >= margin && y >= margin && x < image->width - 1 - margin &&
           y < image->height - 1 - margin;
}

// Moves (x, y) to the best agreement with the window; brightness and contrast may differ. Returns
// false if it does not converge near the start or the windows are not alike.
static bool align(const struct window *w, const struct image_u8 *image, double px[2]) {
    INVARIANT(w->xx >= 0 && w->yy >= 0);
    const double determinant = w->xx * w->yy - w->xy * w->xy;
    const double start[2] = {px[0], px[1]};
    double correlation = 0;
    if (!(determinant > 1e-3 * w->xx * w->yy)) {
        return false;
    }
    for (int round = 0; round < STEPS; round++) {
        double value[WINDOW], mean = 0, square = 0, product = 0, bx = 0, by = 0;
        if (!is_inside(image, px[0], px[1])) {
            return false;
        }
        int n = 0;
        for (int j = -RADIUS; j <= RADIUS; j++) {
            for (int i = -RADIUS; i <= RADIUS; i++, n++) {
                value[n] = value_at(image, px[0] + i, px[1] + j);
                mean += value[n];
            }
        }
        mean /= WINDOW;
        for (n = 0; n < WINDOW; n++) {
            value[n] -= mean;
            square += value[n] * value[n];
            product += value[n] * (double)w->value[n];
        }
        correlation = product / sqrt(square * w->square + 1e-9);
        const double gain = square > 0 ? sqrt(w->square / square) : 1;
        for (n = 0; n < WINDOW; n++) {
            const double difference = gain * value[n] - (double)w->value[n];
            bx += (double)w->gx[n] * difference;
            by += (double)w->gy[n] * difference;
        }
        const double dx = -(w->yy * bx - w->xy * by) / determinant;
        const double dy = -(w->xx * by - w->xy * bx) / determinant;
        px[0] += dx;
        px[1] += dy;
        const double away_x = px[0] - start[0], away_y = px[1] - start[1];
        if (!(away_x * away_x + away_y * away_y < 16.0)) {
            return false;
        }
        if (dx * dx + dy * dy < 1e-4) {
            return correlation > 0.85;
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

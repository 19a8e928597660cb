// SPDX-License-Identifier: Apache-2.0
// What bf537_cycles.c measures: a synthetic pair, and the rig of it.
#ifndef VERGENCE_TESTS_STUDY_BENCH_BF537_SCENE_H
#define VERGENCE_TESTS_STUDY_BENCH_BF537_SCENE_H

#include <stdint.h>

#include "stereo/geometry/calibration.h"
#include "stereo/geometry/rectify.h"
#include "stereo/image/image.h"

static uint32_t random_state;

static inline uint32_t next_random(void) {
    random_state = random_state * 1664525u + 1013904223u;
    return random_state >> 16;
}

// Disparity of a left pixel: a slanted plane, and in front of it a rectangle and a curved ridge.
static inline int disparity_at(int x, int y, int width, int height, int most) {
    const int across = 64 * x / width, down = 64 * y / height;
    if (across > 20 && across < 34 && down > 16 && down < 48) {
        return most * 3 / 4;
    }
    const int beside = across > 46 ? across - 46 : 46 - across;
    const int ridge = beside < 8 ? (64 - beside * beside) * most / 192 : 0;
    return most / 8 + most * down / 256 + ridge;
}

// Values between nodes every four pixels, and some of single pixels.
static inline void fill_texture(uint8_t *pixels, int width, int height) {
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const int coarse = (x / 4 * 73 ^ y / 4 * 151) * 37 >> 2 & 127;
            pixels[y * width + x] = (uint8_t)(40 + coarse + (int)(next_random() & 31));
        }
    }
}

static inline void fill_right(const struct image_u8 *left, const struct image_u8 *right,
                              int disparities) {
    for (int y = 0; y < left->height; y++) {
        const uint8_t *from = image_u8_row(left, y);
        uint8_t *to = image_u8_row(right, y);
        for (int x = 0; x < left->width; x++) {
            to[x] = (uint8_t)(40 + (next_random() & 127));
        }
        for (int x = 0; x < left->width; x++) {
            const int at = x - disparity_at(x, y, left->width, left->height, disparities);
            if (at >= 0) {
                to[at] = (uint8_t)(from[x] + (int)(next_random() & 3));
            }
        }
    }
}

// A pair verged by 6 degrees, seen by lenses that distort.
static inline struct calibration rig_of(int width, int height) {
    const struct lens lens = {.width_px = width,
                              .height_px = height,
                              .fx_px = 2.0 * width,
                              .fy_px = 2.0 * width,
                              .cx_px = 0.5 * width,
                              .cy_px = 0.5 * height,
                              .k1 = -0.12,
                              .k2 = 0.1};
    struct calibration rig = {.id = "bench", .left = lens, .right = lens};
    rig.rotation_right_left_rad[1] = 0.1;
    rig.rotation_right_left_rad[2] = 0.01;
    rig.translation_right_left_mm[0] = -120;
    return rig;
}

// Half the angle for each side; the plan is given, since it is the set-up of a pan or zoom.
static inline struct rectify_plan plan_of(const struct calibration *rig, int width, int height) {
    const double cosine = 0.99875026, sine = 0.04997917;
    const double left[9] = {cosine, 0, -sine, 0, 1, 0, sine, 0, cosine};
    const double right[9] = {cosine, 0, sine, 0, 1, 0, -sine, 0, cosine};
    struct rectify_plan plan = {.width_px = width,
                                .height_px = height,
                                .f_px = 0.5 * rig->left.fx_px,
                                .fy_px = 0.5 * rig->left.fx_px,
                                .cx_left_px = 0.5 * width,
                                .cx_right_px = 0.5 * width,
                                .cy_px = 0.5 * height,
                                .baseline_mm = 120,
                                .disparity_count = 64};
    for (int i = 0; i < 9; i++) {
        plan.R_rect_left[i] = left[i];
        plan.R_rect_right[i] = right[i];
    }
    return plan;
}

#endif

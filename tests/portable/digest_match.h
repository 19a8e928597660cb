// SPDX-License-Identifier: Apache-2.0
// The checksums of core_digest.c over matching and refining a pair, and the pair itself.
#ifndef VERGENCE_TESTS_PORTABLE_DIGEST_MATCH_H
#define VERGENCE_TESTS_PORTABLE_DIGEST_MATCH_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/arena.h"
#include "core/error.h"
#include "digest_numbers.h"
#include "stereo/match/checks.h"
#include "stereo/match/kernels.h"
#include "stereo/match/match.h"
#include "stereo/row_residual.h"
#include "stereo/subpixel.h"

enum { PAIR_WIDTH = 90, PAIR_HEIGHT = 45, PAIR_PIXELS = PAIR_WIDTH * PAIR_HEIGHT };

// A pair to be matched and what is found.
static struct {
    uint8_t left[PAIR_PIXELS], right[PAIR_PIXELS];
    uint8_t left_colour[3 * PAIR_PIXELS], right_colour[3 * PAIR_PIXELS];
    struct rectify_span left_span[PAIR_HEIGHT], right_span[PAIR_HEIGHT];
    int32_t disparity_q8[PAIR_PIXELS];
    uint8_t reason[PAIR_PIXELS], confidence[PAIR_PIXELS];
    uint8_t sigma[PAIR_PIXELS];
} pair;

static struct match_input pair_input = {
    .left = {pair.left, PAIR_WIDTH, PAIR_HEIGHT, PAIR_WIDTH},
    .right = {pair.right, PAIR_WIDTH, PAIR_HEIGHT, PAIR_WIDTH},
    .left_span = pair.left_span,
    .right_span = pair.right_span,
    .resampled = true,
    .left_colour = {pair.left_colour, PAIR_WIDTH, PAIR_HEIGHT, 3 * PAIR_WIDTH},
    .right_colour = {pair.right_colour, PAIR_WIDTH, PAIR_HEIGHT, 3 * PAIR_WIDTH},
};

// The short form matches fewer rows.
static void shorten_pair(void) {
    const int height = PAIR_HEIGHT * 3 / 4;
    pair_input.left.height = pair_input.right.height = height;
    pair_input.left_colour.height = pair_input.right_colour.height = height;
}

static struct match_output pair_output(void) {
    const int height = pair_input.left.height;
    return (struct match_output){
        .disparity_q8 = {pair.disparity_q8, PAIR_WIDTH, height, PAIR_WIDTH},
        .reason = {pair.reason, PAIR_WIDTH, height, PAIR_WIDTH},
        .confidence = {pair.confidence, PAIR_WIDTH, height, PAIR_WIDTH},
    };
}

// Smooth noise in front of smooth noise; the right rows are half a pixel lower and have some noise
// of their own. `near_px` and `far_px` are the disparities.
static void make_pair(int near_px, int far_px) {
    enum { MARGIN = 40, ROOM = PAIR_WIDTH + 2 * MARGIN };
    static int noise[2][PAIR_HEIGHT + 2][ROOM];
    for (int layer = 0; layer < 2; layer++) {
        for (int y = 0; y < PAIR_HEIGHT + 2; y++) {
            int before = 128;
            for (int x = 0; x < ROOM; x++) {
                const int fresh = (int)(next_random() >> 56);
                noise[layer][y][x] = (before + fresh) / 2;
                before = fresh;
            }
        }
    }
    for (int i = 0; i < PAIR_PIXELS; i++) {
        const int x = i % PAIR_WIDTH, y = i / PAIR_WIDTH;
        // Column of the left pixel seen here if it is on the near layer.
        const int right_x = x + near_px;
        const int near_left = x >= 30 && x < 60 && y >= 10 && y < 35;
        const int near_right = right_x >= 30 && right_x < 60 && y >= 10 && y < 35;
        const int(*seen)[ROOM] = noise[near_left];
        pair.left[i] = (uint8_t)((seen[y][x + MARGIN] + seen[y + 1][x + MARGIN]) / 2);
        seen = noise[near_right];
        const int from = x + MARGIN + (near_right ? near_px : far_px);
        const int grey = (seen[y][from] + 3 * seen[y + 1][from]) / 4;
        pair.right[i] = (uint8_t)(grey / 2 + 60 + (int)(next_random() >> 62));
        for (int c = 0; c < 3; c++) {
            pair.left_colour[3 * i + c] = (uint8_t)(pair.left[i] / 2 + (int)(next_random() >> 58));
            pair.right_colour[3 * i + c] = (uint8_t)(pair.right[i] + (int)(next_random() >> 61));
        }
    }
    for (int y = 0; y < PAIR_HEIGHT; y++) {
        pair.left_span[y] = (struct rectify_span){(int16_t)(y % 7), (int16_t)(PAIR_WIDTH - y % 5)};
        pair.right_span[y] =
            (struct rectify_span){(int16_t)(y % 3), (int16_t)(PAIR_WIDTH - y % 11)};
    }
}

static void must_succeed(int error, const char *what) {
    if (error != ERROR_OK) {
        fprintf(stderr, "core_digest: %s failed: %d\n", what, error);
        exit(1);
    }
}

static void match_pair(const struct match_options *options) {
    const size_t bytes = match_needs(PAIR_WIDTH, pair_input.left.height, options, 1).bytes;
    void *memory = must_have(bytes);
    struct arena working;
    arena_init(&working, memory, bytes);
    struct match_output output = pair_output();
    must_succeed(match_run(&pair_input, options, &parallel_serial, NULL, NULL, &working, &output),
                 "match");
    free(memory);
}

static uint32_t add_matches(uint32_t crc) {
    for (int i = 0; i < PAIR_PIXELS; i++) {
        crc = add_bits(crc, (uint32_t)pair.disparity_q8[i], 4);
        crc = add_bits(crc, pair.reason[i], 1);
        crc = add_bits(crc, pair.confidence[i], 1);
    }
    return crc;
}

// Every level of kernels supported by this processor must agree.
static uint32_t match_with_all_levels(struct match_options options) {
    static const char *const levels[] = {"plain", "sse41", "avx2", "neon"};
    uint32_t plain = 0;
    for (size_t level = 0; level < sizeof levels / sizeof levels[0]; level++) {
        options.kernels = match_kernels_named(levels[level]);
        if (options.kernels == NULL) {
            continue;  // not on this processor
        }
        match_pair(&options);
        const uint32_t sum = add_matches(0);
        if (level == 0) {
            plain = sum;
        } else if (sum != plain) {
            fprintf(stderr, "core_digest: match: %s differs from plain, preset %s\n", levels[level],
                    match_preset_name(options.preset));
            exit(1);
        }
    }
    return plain;
}

static uint32_t digest_match(void) {
    // Lanes that are compiled for, and others; disparities of both signs.
    static const int counts[] = {12, 20, 40, 64};
    uint32_t crc = 0;
    for (size_t i = 0; i < (is_short ? 1 : sizeof counts / sizeof counts[0]); i++) {
        const int far_px = i % 2 == 0 ? 2 : -5;
        make_pair(far_px + counts[i] / 3, far_px);
        struct match_options options = match_default_options(far_px - 2, counts[i]);
        options.keep_all = i == 3;
        for (unsigned preset = 0; preset < MATCH_PRESET_COUNT; preset += (unsigned)draws(1, 2)) {
            options.preset = (enum match_preset)preset;
            crc = add_bits(crc, match_with_all_levels(options), 4);
        }
    }
    return crc;
}

// The greedy path.
static uint32_t digest_paper(void) {
    uint32_t crc = 0;
    for (int i = is_short ? 1 : 0; i < draws(6, 2); i++) {
        const int far_px = 5 - 3 * i;
        make_pair(far_px + 4 + 2 * i, far_px);
        struct match_options options = match_default_options(far_px - 3, 1 + 13 * i);
        options.preset = MATCH_PRESET_PAPER;
        options.keep_all = i == 5;
        const size_t bytes = match_paper_need_bytes(PAIR_WIDTH, &options);
        void *memory = must_have(bytes);
        struct arena working;
        arena_init(&working, memory, bytes);
        struct match_output output = pair_output();
        must_succeed(match_paper_run(&pair_input, &options, NULL, NULL, &working, &output),
                     "the greedy path");
        free(memory);
        crc = add_matches(crc);
    }
    return crc;
}

static uint32_t digest_refine(void) {
    uint32_t crc = 0;
    for (int i = 0; i < draws(3, 1); i++) {
        make_pair(9 + i, 3);
        const struct match_options options = match_default_options(0, 16);
        match_pair(&options);
        const size_t needed[2] = {subpixel_need_bytes(PAIR_WIDTH, 1), row_residual_need_bytes()};
        const size_t bytes = (needed[0] > needed[1] ? needed[0] : needed[1]);
        void *memory = must_have(bytes);
        struct arena working;
        arena_init(&working, memory, bytes);
        struct match_output output = pair_output();
        const int height = pair_input.left.height;
        struct image_u8 sigma = {pair.sigma, PAIR_WIDTH, height, PAIR_WIDTH};
        struct subpixel fit;
        must_succeed(
            subpixel_begin(&fit, &pair_input, &parallel_serial, &working, &output, &sigma, false),
            "refine");
        subpixel_advance(&fit, height);
        arena_release(&working, 0);
        struct triangulate_vertical vertical;
        struct row_residual residual;
        must_succeed(row_residual_begin(&residual, &pair_input, &output, &working),
                     "measurement of the vertical disparity");
        row_residual_add(&residual, height);
        row_residual_finish(&residual, &vertical);
        must_succeed(vertical.samples > 0 ? ERROR_OK : ERROR_NO_SURFACE,
                     "finding samples of the vertical disparity");
        free(memory);
        crc = add_matches(crc);
        for (int k = 0; k < PAIR_PIXELS; k++) {
            crc = add_bits(crc, subpixel_sigma_q8(pair.sigma[k]), 2);
        }
        const double numbers[] = {vertical.offset_px, vertical.slope_x,   vertical.slope_y,
                                  vertical.rms_px,    vertical.median_px, vertical.p95_px};
        crc = add_doubles(crc, numbers, 6);
        crc = add_bits(crc, (uint64_t)vertical.samples, 4);
    }
    return crc;
}

#endif

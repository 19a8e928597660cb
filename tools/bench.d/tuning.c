// SPDX-License-Identifier: Apache-2.0
// usage: tuning LIST: matches pairs with the preset best and prints their mean bad-1.0 in percent,
// filled by the rule of `vergence evaluate` (recorded pairs), and the mean percentage of kept
// pixels that are off by more than 1 px (rendered ones). A line of LIST is a pair: the file of its
// arrays, width, height, disparity_min, disparity_count, rendered, truth in whole pixels. Written
// by tuning.py: the arrays are left and right in colour and in grey, truth as float, mask.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/arena.h"
#include "core/error.h"
#include "stereo/image/reason.h"
#include "stereo/match/match.h"

enum { VISIBLE = 255 };

struct pair {
    int width, height, rendered, whole;
    struct match_options options;
    struct match_input input;
    const float *truth;
    const uint8_t *mask;  // 0: unknown
};

struct sums {
    double percent;
    int pairs;
};

static void *must(void *taken) {
    if (taken == NULL) {
        fprintf(stderr, "tuning: out of memory\n");
        exit(1);
    }
    return taken;
}

static uint8_t *read_arrays(const char *path, size_t bytes) {
    uint8_t *data = must(malloc(bytes));
    FILE *file = fopen(path, "rb");
    if (file == NULL || fread(data, 1, bytes, file) != bytes) {
        fprintf(stderr, "tuning: cannot read %s\n", path);
        exit(1);
    }
    fclose(file);
    return data;
}

static double percent(long part, long whole) {
    return whole > 0 ? 100.0 * (double)part / (double)whole : 0;
}

// Gaps of a row get the farther of the disparities beside.
static void fill_row(float *row, int width) {
    for (int x = 0; x < width; x++) {
        int end = x;
        while (end < width && !isfinite(row[end])) {
            end++;
        }
        const float before = x > 0 ? row[x - 1] : INFINITY;
        const float after = end < width ? row[end] : INFINITY;
        for (; x < end; x++) {
            row[x] = before < after ? before : after;
        }
    }
}

static double score(const struct pair *pair, const int32_t *disparity_q8, const uint8_t *reason) {
    float *row = must(malloc((size_t)pair->width * sizeof *row));
    long kept = 0, kept_wrong = 0, seen = 0, wrong = 0;
    for (int y = 0; y < pair->height; y++) {
        const size_t begin = (size_t)y * (size_t)pair->width;
        for (int x = 0; x < pair->width; x++) {
            const size_t i = begin + (size_t)x;
            const float own = (float)disparity_q8[i] / 256;
            row[x] = reason[i] != REASON_VALID ? INFINITY : pair->whole ? floorf(own + 0.5F) : own;
            if (isfinite(row[x]) && isfinite(pair->truth[i]) && pair->mask[i] != 0) {
                kept++;
                kept_wrong += fabsf(row[x] - pair->truth[i]) > 1;
            }
        }
        fill_row(row, pair->width);
        for (int x = 0; x < pair->width; x++) {
            const size_t i = begin + (size_t)x;
            if (isfinite(pair->truth[i]) && pair->mask[i] == VISIBLE) {
                seen++;
                wrong += !(fabsf(row[x] - pair->truth[i]) <= 1);
            }
        }
    }
    free(row);
    return pair->rendered ? percent(kept_wrong, kept) : percent(wrong, seen);
}

static double match(const struct pair *pair) {
    const size_t pixels = (size_t)pair->width * (size_t)pair->height;
    int32_t *disparity_q8 = must(calloc(pixels, sizeof *disparity_q8));
    uint8_t *maps = must(calloc(2 * pixels, 1));
    struct match_output output = {
        {disparity_q8, pair->width, pair->height, pair->width},
        {maps, pair->width, pair->height, pair->width},
        {maps + pixels, pair->width, pair->height, pair->width},
    };
    const size_t bytes = match_need_bytes(pair->width, &pair->options, 1);
    void *memory =
        must(aligned_alloc(ARENA_ALIGNMENT, (bytes / ARENA_ALIGNMENT + 1) * ARENA_ALIGNMENT));
    struct arena arena;
    arena_init(&arena, memory, bytes);
    if (match_run(&pair->input, &pair->options, &parallel_serial, NULL, NULL, &arena, &output) !=
        ERROR_OK) {
        fprintf(stderr, "tuning: the matcher failed\n");
        exit(1);
    }
    const double result = score(pair, disparity_q8, maps);
    free(disparity_q8);
    free(maps);
    free(memory);
    return result;
}

int main(int argc, char **argv) {
    FILE *list = argc == 2 ? fopen(argv[1], "r") : NULL;
    if (list == NULL) {
        fprintf(stderr, "usage: tuning LIST\n");
        return 2;
    }
    struct sums sums[2] = {{0, 0}, {0, 0}};
    struct pair pair;
    char path[4096];
    int min, count;
    while (fscanf(list, "%4095s %d %d %d %d %d %d", path, &pair.width, &pair.height, &min, &count,
                  &pair.rendered, &pair.whole) == 7) {
        const int width = pair.width, height = pair.height;
        const size_t pixels = (size_t)width * (size_t)height;
        uint8_t *data = read_arrays(path, 13 * pixels);
        pair.truth = (const float *)(const void *)data;
        uint8_t *grey = data + 4 * pixels, *colour = data + 6 * pixels;
        pair.mask = data + 12 * pixels;
        pair.input = (struct match_input){
            .left = {grey, width, height, width},
            .right = {grey + pixels, width, height, width},
            .left_colour = {colour, width, height, 3 * width},
            .right_colour = {colour + 3 * pixels, width, height, 3 * width},
        };
        pair.options = match_default_options(min, count);
        pair.options.preset = MATCH_PRESET_BEST;
        sums[pair.rendered].percent += match(&pair);
        sums[pair.rendered].pairs++;
        free(data);
    }
    fclose(list);
    for (int i = 0; i < 2; i++) {
        printf("%.4f ", sums[i].pairs > 0 ? sums[i].percent / sums[i].pairs : 0);
    }
    printf("\n");
    return 0;
}

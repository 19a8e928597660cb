// SPDX-License-Identifier: Apache-2.0
// usage: tuning LIST: matches pairs with the preset best and prints their mean bad-1.0 in percent,
// filled by the rule of `vergence evaluate` (recorded pairs), the mean percentage of kept pixels
// that are off by more than 1 px, and of textured ones of the view's object that are kept and right
// (rendered ones), in the last line; before it a line of each pair. A line of LIST is a pair: the
// file of its arrays, width, height, disparity_min, disparity_count, rendered, truth in whole
// pixels. Written by tuning.py: the arrays are truth as float, left and right in grey and in
// colour, mask.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/arena.h"
#include "core/error.h"
#include "stereo/image/reason.h"
#include "stereo/match/match.h"

enum { VISIBLE = 255, TEXTURED = 254 };  // the latter is also visible

struct pair {
    int width, height, rendered, whole;
    struct match_options options;
    struct match_input input;
    const float *truth;
    const uint8_t *mask;  // 0: unknown
};

// In percent.
struct figures {
    double wrong;  // bad-1.0, or of what is kept
    double right;  // share of textured pixels that is right
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

static bool is_near(float disparity, float truth) {
    return fabsf(disparity - truth) <= 1;
}

static float value_of(const struct pair *pair, int32_t disparity_q8, uint8_t reason) {
    const float own = (float)disparity_q8 / 256;
    if (reason != REASON_VALID) {
        return INFINITY;
    }
    return pair->whole ? floorf(own + 0.5F) : own;
}

static struct figures score(const struct pair *pair, const int32_t *disparity_q8,
                            const uint8_t *reason) {
    float *row = must(malloc((size_t)pair->width * sizeof *row));
    long kept = 0, kept_wrong = 0, seen = 0, wrong = 0, textured = 0, right = 0;
    for (int y = 0; y < pair->height; y++) {
        const size_t begin = (size_t)y * (size_t)pair->width;
        for (int x = 0; x < pair->width; x++) {
            const size_t i = begin + (size_t)x;
            row[x] = value_of(pair, disparity_q8[i], reason[i]);
            if (isfinite(row[x]) && isfinite(pair->truth[i]) && pair->mask[i] != 0) {
                kept++;
                kept_wrong += !is_near(row[x], pair->truth[i]);
            }
        }
        for (int x = 0; x < pair->width; x++) {
            const bool counts = pair->mask[begin + (size_t)x] == TEXTURED;
            textured += counts;
            right += counts && is_near(row[x], pair->truth[begin + (size_t)x]);
        }
        fill_row(row, pair->width);
        for (int x = 0; x < pair->width; x++) {
            const size_t i = begin + (size_t)x;
            if (isfinite(pair->truth[i]) && pair->mask[i] >= TEXTURED) {
                seen++;
                wrong += !is_near(row[x], pair->truth[i]);
            }
        }
    }
    free(row);
    return (struct figures){pair->rendered ? percent(kept_wrong, kept) : percent(wrong, seen),
                            percent(right, textured)};
}

// The columns of each row that are not black.
static struct rectify_span *spans_of(const struct image_u8 *image) {
    struct rectify_span *spans = must(calloc((size_t)image->height, sizeof *spans));
    for (int y = 0; y < image->height; y++) {
        const uint8_t *row = image_u8_row(image, y);
        int begin = 0, end = image->width;
        while (begin < end && row[begin] == 0) {
            begin++;
        }
        while (end > begin && row[end - 1] == 0) {
            end--;
        }
        if (begin < end) {
            spans[y] = (struct rectify_span){(int16_t)begin, (int16_t)end};
        }
    }
    return spans;
}

static struct figures match(const struct pair *pair) {
    const size_t pixels = (size_t)pair->width * (size_t)pair->height;
    int32_t *disparity_q8 = must(calloc(pixels, sizeof *disparity_q8));
    uint8_t *maps = must(calloc(2 * pixels, 1));
    struct match_output output = {
        {disparity_q8, pair->width, pair->height, pair->width},
        {maps, pair->width, pair->height, pair->width},
        {maps + pixels, pair->width, pair->height, pair->width},
    };
    const size_t bytes = match_needs(pair->width, pair->height, &pair->options, 1).bytes;
    void *memory =
        must(aligned_alloc(ARENA_ALIGNMENT, (bytes / ARENA_ALIGNMENT + 1) * ARENA_ALIGNMENT));
    struct arena arena;
    arena_init(&arena, memory, bytes);
    if (match_run(&pair->input, &pair->options, &parallel_serial, NULL, NULL, &arena, &output) !=
        ERROR_OK) {
        fprintf(stderr, "tuning: the matcher failed\n");
        exit(1);
    }
    const struct figures result = score(pair, disparity_q8, maps);
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
    double bad = 0, kept_wrong = 0, right = 0;
    int pairs = 0, views = 0;
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
        struct rectify_span *left = spans_of(&pair.input.left);
        struct rectify_span *right_spans = spans_of(&pair.input.right);
        if (pair.rendered) {  // rectified from raw images
            pair.input.left_span = left;
            pair.input.right_span = right_spans;
            pair.input.resampled = true;
        }
        const struct figures own = match(&pair);
        bad += pair.rendered ? 0 : own.wrong;
        kept_wrong += pair.rendered ? own.wrong : 0;
        right += pair.rendered ? own.right : 0;
        pairs += !pair.rendered;
        views += pair.rendered;
        printf("%.2f %.2f\n", own.wrong, own.right);
        free(left);
        free(right_spans);
        free(data);
    }
    fclose(list);
    printf("%.4f %.4f %.4f\n", pairs > 0 ? bad / pairs : 0, views > 0 ? kept_wrong / views : 0,
           views > 0 ? right / views : 0);
    return 0;
}

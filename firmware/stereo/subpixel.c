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
//
// Each stage needs two rows above and below its own, so that the five of them are ten rows behind
// the matcher, and keep only those rows (subpixel_text.h). Threads share the columns: each has a
// strip, and computes the columns on both sides that they depend on too. All strips first take over
// the rows of a batch, since the others' results replace them.
#include "stereo/subpixel.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/image/reason.h"
#include "stereo/subpixel_strip.h"

enum {
    // Of images that were rectified elsewhere and of our own.
    FLOOR_SIGMA_Q8 = 22,
    RESAMPLED_SIGMA_Q8 = 5,
    STRIP_MIN_COLUMNS = 64,
    VECTOR_ELEMENTS = 16,  // rows are padded to these and by these, so that loops need no rest
    ARRIVING_ROWS = SUBPIXEL_BATCH_ROWS + SUBPIXEL_REACH + SUBPIXEL_RADIUS,
    TERM_ROWS = SUBPIXEL_WINDOW + 1,     // one leaves
    WAITING_ROWS = SUBPIXEL_RADIUS + 1,  // from stage to stage
    // Columns in the right image that are not in it, whatever moves.
    WHOLE_MIN = -1024,
    WHOLE_MAX = 2 * IMAGE_MAX_SIDE_PX,
    SHORT_ROWS = 3 * ARRIVING_ROWS +
                 SUBPIXEL_STEPS * (WAITING_ROWS + SUBPIXEL_WINDOW + 3 * TERM_ROWS + 3) +
                 WAITING_ROWS + 7,
    LONG_ROWS = SUBPIXEL_STEPS * 4 + 6,
};

static int strips_of(int width, int threads) {
    const int most = width / STRIP_MIN_COLUMNS;
    const int fewer = threads < most ? threads : most;
    return fewer > 1 ? fewer : 1;
}

// Elements of a row of a strip's memory, with what loops read on both sides of it.
static size_t row_elements(int columns) {
    const size_t needed = (size_t)columns + 2 * SUBPIXEL_ASIDE;
    return (needed + VECTOR_ELEMENTS - 1) / VECTOR_ELEMENTS * VECTOR_ELEMENTS + VECTOR_ELEMENTS;
}

static size_t strip_bytes(int columns) {
    const size_t row = row_elements(columns);
    return VECTOR_ELEMENTS * sizeof(uint32_t) +
           row * (SHORT_ROWS * sizeof(uint16_t) + LONG_ROWS * sizeof(uint32_t));
}

size_t subpixel_need_bytes(int width, int threads) {
    const int strips = strips_of(width, threads);
    return arena_need_bytes((size_t)strips, sizeof(struct subpixel_strip)) +
           (size_t)strips * arena_need_bytes(strip_bytes((width + strips - 1) / strips), 1);
}

static uint32_t *take_long(unsigned char **memory, size_t row) {
    uint32_t *taken = (void *)*memory;
    *memory += row * sizeof *taken;
    return taken;
}

static uint16_t *take_short(unsigned char **memory, size_t row, int rows) {
    uint16_t *taken = (void *)*memory;
    *memory += row * (size_t)rows * sizeof *taken;
    return taken;
}

static struct subpixel_ring take_ring(unsigned char **memory, size_t row, int rows) {
    return (struct subpixel_ring){take_short(memory, row, rows), rows, (ptrdiff_t)row};
}

static void divide_step(struct subpixel_step *step, unsigned char **memory, size_t row) {
    step->sums.gradient2 = (int32_t *)take_long(memory, row);
    step->sums.product = (int32_t *)take_long(memory, row);
    step->sums.difference2 = (int32_t *)take_long(memory, row);
    step->sums.neighbours = (int32_t *)take_long(memory, row);
    step->sums.count = take_short(memory, row, 1);
    step->sums.gradient = (int16_t *)take_short(memory, row, 1);
    step->sums.difference = (int16_t *)take_short(memory, row, 1);
    step->smooth = take_ring(memory, row, WAITING_ROWS);
    step->fitted = take_ring(memory, row, SUBPIXEL_WINDOW);
    step->used = take_ring(memory, row, TERM_ROWS);
    step->gradient = take_ring(memory, row, TERM_ROWS);
    step->difference = take_ring(memory, row, TERM_ROWS);
}

// Gives the strip its rows, with VECTOR_ELEMENTS zeros before each and after the last.
static void divide_memory(struct subpixel_strip *strip, unsigned char *memory) {
    const size_t row = row_elements(strip->end - strip->begin);
    const size_t bytes = strip_bytes(strip->end - strip->begin);
    memset(memory, 0, bytes);
    unsigned char *const end = memory + bytes;
    memory += VECTOR_ELEMENTS * sizeof(uint32_t);
    strip->columns = (int)row - VECTOR_ELEMENTS;
    strip->four = take_long(&memory, row);
    strip->count = (int32_t *)take_long(&memory, row);
    strip->gradient2 = (int32_t *)take_long(&memory, row);
    strip->product = (int32_t *)take_long(&memory, row);
    strip->difference2 = (int32_t *)take_long(&memory, row);
    strip->together = (int32_t *)take_long(&memory, row);
    for (int i = 0; i < SUBPIXEL_STEPS; i++) {
        divide_step(&strip->step[i], &memory, row);
    }
    strip->disparity = take_ring(&memory, row, ARRIVING_ROWS);
    strip->bad = take_ring(&memory, row, ARRIVING_ROWS);
    strip->whole = take_ring(&memory, row, ARRIVING_ROWS);
    strip->bound = take_ring(&memory, row, WAITING_ROWS);
    strip->pairs = take_short(&memory, row, 1);
    strip->rough = take_short(&memory, row, 1);
    strip->last = take_short(&memory, row, 1);
    strip->sigma = take_short(&memory, row, 1);
    strip->column = take_short(&memory, row, 1);
    strip->between = (int16_t *)take_short(&memory, row, 1);
    strip->left = (uint8_t *)take_short(&memory, row, 1) + VECTOR_ELEMENTS;
    INVARIANT(memory == end);
    // Above the image.
    memset(strip->bad.data, UINT8_MAX, row * ARRIVING_ROWS * sizeof *strip->bad.data);
}

int subpixel_begin(struct subpixel *fit, const struct match_input *input,
                   const struct parallel *parallel, struct arena *arena,
                   struct match_output *output, struct image_u8 *sigma, bool plain) {
    INVARIANT(parallel->threads >= 1 && input->left.width >= MATCH_MIN_WIDTH_PX);
    const size_t mark = arena_mark(arena);
    const int width = input->left.width;
    const int32_t floor_q8 = input->resampled ? RESAMPLED_SIGMA_Q8 : FLOOR_SIGMA_Q8;
    *fit = (struct subpixel){.parallel = parallel,
                             .strip_count = strips_of(width, parallel->threads),
                             .height = input->left.height,
                             .plain = plain};
    fit->strips = arena_take(arena, (size_t)fit->strip_count, sizeof *fit->strips);
    for (int i = 0; fit->strips != NULL && i < fit->strip_count; i++) {
        struct subpixel_strip *strip = &fit->strips[i];
        *strip = (struct subpixel_strip){
            .input = input,
            .output = output,
            .sigma_codes = sigma,
            .floor_q16 = floor_q8 * floor_q8,
            .begin = (int)((int64_t)width * i / fit->strip_count),
            .end = (int)((int64_t)width * (i + 1) / fit->strip_count),
        };
        strip->x_first = strip->begin - SUBPIXEL_ASIDE;
        unsigned char *memory = arena_take(arena, strip_bytes(strip->end - strip->begin), 1);
        if (memory == NULL) {
            fit->strips = NULL;
            break;
        }
        divide_memory(strip, memory);
    }
    if (fit->strips == NULL) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    return ERROR_OK;
}

// Takes row y over, below the image one without disparities.
static void take_over_row(const struct subpixel_strip *strip, int y) {
    const struct match_output *output = strip->output;
    uint16_t *bad = subpixel_row(&strip->bad, y);
    memset(bad, UINT8_MAX, (size_t)strip->columns * sizeof *bad);
    if (y >= output->reason.height) {
        return;
    }
    const uint8_t *reason = image_u8_row(&output->reason, y);
    const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y);
    uint16_t *disparity = subpixel_row(&strip->disparity, y);
    int16_t *whole = (int16_t *)subpixel_row(&strip->whole, y);
    const int begin = strip->x_first > 0 ? strip->x_first : 0;
    const int columns = output->reason.width - begin;
    const int before = begin - strip->x_first;
    const int count = columns < strip->columns - before ? columns : strip->columns - before;
    SUBPIXEL_EACH_ALONE
    for (int i = 0; i < count; i++) {
        const int32_t disparity_here = disparity_q8[begin + i];
        const int32_t place = begin + i - (disparity_here >> 8);
        const int32_t high = place < WHOLE_MAX ? place : WHOLE_MAX;
        disparity[before + i] = (uint16_t)disparity_here;
        bad[before + i] = reason[begin + i] == REASON_VALID ? 0 : UINT16_MAX;
        whole[before + i] = (int16_t)(high > WHOLE_MIN ? high : WHOLE_MIN);
    }
}

static void take_over_part(void *context, int index) {
    const struct subpixel *fit = context;
    for (int y = fit->arrived; y < fit->until; y++) {
        take_over_row(&fit->strips[index], y);
    }
}

static subpixel_loops *loops_of(const struct subpixel *fit) {
#if defined(__x86_64__)
    if (!fit->plain && __builtin_cpu_supports("avx2")) {
        return subpixel_avx2_loops;
    }
#endif
    (void)fit;
    return subpixel_plain_loops;
}

// Row y is finished: its own columns go into the results.
static void write_row(const struct subpixel_strip *strip, int y) {
    const uint8_t *reason = image_u8_row(&strip->output->reason, y) + strip->begin;
    int32_t *disparity_q8 = image_i32_row(&strip->output->disparity_q8, y) + strip->begin;
    uint8_t *codes = image_u8_row(strip->sigma_codes, y) + strip->begin;
    const uint16_t *sigma = strip->sigma + SUBPIXEL_ASIDE;
    const uint16_t *last = strip->last + SUBPIXEL_ASIDE;
    const int columns = strip->end - strip->begin;
    SUBPIXEL_EACH_ALONE
    for (int x = 0; x < columns; x++) {
        const uint16_t valid = reason[x] == REASON_VALID ? UINT16_MAX : 0;
        const int32_t before_q8 = disparity_q8[x];
        const uint16_t moved = (uint16_t)(last[x] - (uint32_t)before_q8);
        disparity_q8[x] = before_q8 + (int16_t)(moved & valid);
        codes[x] = subpixel_sigma_code(sigma[x] & valid);
    }
}

static void refine_part(void *context, int index) {
    const struct subpixel *fit = context;
    subpixel_loops *loops = loops_of(fit);
    for (int y = fit->arrived; y < fit->until; y++) {
        loops(&fit->strips[index], y);
        if (y >= SUBPIXEL_REACH) {
            write_row(&fit->strips[index], y - SUBPIXEL_REACH);
        }
    }
}

int subpixel_advance(struct subpixel *fit, int rows) {
    const int height = fit->height;
    INVARIANT(rows >= 0 && rows <= height);
    _Static_assert((int)SUBPIXEL_LATE_ROWS == (int)SUBPIXEL_REACH, "");
    const int last = rows < height ? rows : height + SUBPIXEL_REACH;
    while (fit->arrived < last) {
        const int left = last - fit->arrived;
        fit->until = fit->arrived + (left < SUBPIXEL_BATCH_ROWS ? left : SUBPIXEL_BATCH_ROWS);
        fit->parallel->run(fit->parallel->self, take_over_part, fit, fit->strip_count);
        fit->parallel->run(fit->parallel->self, refine_part, fit, fit->strip_count);
        fit->arrived = fit->until;
    }
    const int finished = fit->arrived - SUBPIXEL_REACH;
    return finished > 0 ? finished : 0;
}

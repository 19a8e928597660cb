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
#include "stereo/match/checks.h"
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

// Rows of a strip, with VECTOR_ELEMENTS zeros before the first and after each.
static void *take_rows(struct match_memory *memory, const struct subpixel_strip *strip, int rows,
                       size_t element_bytes) {
    const size_t row = row_elements(strip->end - strip->begin);
    const size_t elements = VECTOR_ELEMENTS + row * (size_t)rows;
    uint8_t *taken = match_take(memory, elements, element_bytes);
    if (taken == NULL) {
        return NULL;
    }
    memset(taken, 0, elements * element_bytes);
    return taken + VECTOR_ELEMENTS * element_bytes;
}

static void *take_short(struct match_memory *memory, const struct subpixel_strip *strip) {
    return take_rows(memory, strip, 1, sizeof(uint16_t));
}

static void *take_long(struct match_memory *memory, const struct subpixel_strip *strip) {
    return take_rows(memory, strip, 1, sizeof(uint32_t));
}

static struct subpixel_ring take_ring(struct match_memory *memory,
                                      const struct subpixel_strip *strip, int rows) {
    return (struct subpixel_ring){take_rows(memory, strip, rows, sizeof(uint16_t)), rows,
                                  (ptrdiff_t)row_elements(strip->end - strip->begin)};
}

static void take_step(struct match_memory *memory, const struct subpixel_strip *strip,
                      struct subpixel_step *step) {
    step->sums.gradient2 = take_long(memory, strip);
    step->sums.product = take_long(memory, strip);
    step->sums.difference2 = take_long(memory, strip);
    step->sums.neighbours = take_long(memory, strip);
    step->sums.count = take_short(memory, strip);
    step->sums.gradient = take_short(memory, strip);
    step->sums.difference = take_short(memory, strip);
    step->smooth = take_ring(memory, strip, WAITING_ROWS);
    step->fitted = take_ring(memory, strip, SUBPIXEL_WINDOW);
    step->used = take_ring(memory, strip, TERM_ROWS);
    step->gradient = take_ring(memory, strip, TERM_ROWS);
    step->difference = take_ring(memory, strip, TERM_ROWS);
}

// Gives the strip its rows: what is used most first, as there may be little fast memory.
static void take_strip(struct match_memory *memory, struct subpixel_strip *strip) {
    strip->columns = (int)row_elements(strip->end - strip->begin) - VECTOR_ELEMENTS;
    strip->pairs = take_short(memory, strip);
    strip->rough = take_short(memory, strip);
    strip->last = take_short(memory, strip);
    strip->sigma = take_short(memory, strip);
    strip->column = take_short(memory, strip);
    strip->between = take_short(memory, strip);
    strip->left = take_short(memory, strip);
    strip->four = take_long(memory, strip);
    strip->count = take_long(memory, strip);
    strip->gradient2 = take_long(memory, strip);
    strip->product = take_long(memory, strip);
    strip->difference2 = take_long(memory, strip);
    strip->together = take_long(memory, strip);
    for (int i = 0; i < SUBPIXEL_STEPS; i++) {
        take_step(memory, strip, &strip->step[i]);
    }
    strip->bound = take_ring(memory, strip, WAITING_ROWS);
    strip->disparity = take_ring(memory, strip, ARRIVING_ROWS);
    strip->whole = take_ring(memory, strip, ARRIVING_ROWS);
    strip->bad = take_ring(memory, strip, ARRIVING_ROWS);
    if (strip->bad.data != NULL) {
        // Above the image.
        memset(strip->bad.data, UINT8_MAX,
               (size_t)strip->bad.stride * ARRIVING_ROWS * sizeof *strip->bad.data);
    }
}

size_t subpixel_need_bytes(int width, int threads) {
    const int strips = strips_of(width, threads);
    struct subpixel_strip widest = {.end = (width + strips - 1) / strips};
    struct match_memory memory = {.arena = NULL};
    take_strip(&memory, &widest);
    return arena_need_bytes((size_t)strips, sizeof widest) + (size_t)strips * memory.need_bytes;
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
    struct match_memory memory = {.arena = arena};
    fit->strips = match_take(&memory, (size_t)fit->strip_count, sizeof *fit->strips);
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
        take_strip(&memory, strip);
    }
    if (memory.failed) {
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

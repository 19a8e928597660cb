// SPDX-License-Identifier: Apache-2.0
// Islands of a few pixels are rejected.
// Rows needed: as many above and below as an island may have pixels (speckle_px).
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/image/reason.h"
#include "stereo/match/checks.h"
#include "stereo/match/tuning.h"

// Marks in the reason map while islands are measured; above all reasons.
enum { MARK_QUEUED = 0x40, MARK_UNDECIDED = 0x60, MARK_LARGE = 0x80 };

enum { MAX_PARTS = 8 };

struct place {
    int16_t x, y;
};

struct rows {
    int begin, end;
};

// One thread's share of the rows, and its memory.
struct strip {
    struct match_output *output;
    int begin, end;         // rows
    struct place *queue;    // pixels of an island in the order they were found
    uint8_t *stop;          // whether a pixel does not continue the one to its left, by column
    uint8_t *joins;         // whether a pixel continues a large island above it, by column
    int count, limit;       // pixels of the island found so far, and the limit
    bool large;             // it touches pixels of a known large island
    bool cut;               // it may continue beyond the strip
    struct rows undecided;  // rows of small islands that may continue beyond the strip
};

struct filtering {
    struct match_output *output;
    int limit, parts;
    struct strip strip[MAX_PARTS];
};

static struct rows with_row(struct rows rows, int y) {
    return (struct rows){y < rows.begin ? y : rows.begin, y < rows.end ? rows.end : y + 1};
}

static int part_count(int threads) {
    return threads < MAX_PARTS ? threads : MAX_PARTS;
}

// In one comparison, of numbers without a sign.
static inline bool is_step(int32_t a_q8, int32_t b_q8) {
    return (uint32_t)a_q8 - (uint32_t)b_q8 + TUNE_ISLAND_STEP > 2 * TUNE_ISLAND_STEP;
}

static void visit(struct strip *strip, int32_t from_q8, int x, int y) {
    struct match_output *output = strip->output;
    if (x < 0 || x >= output->reason.width) {
        return;
    }
    if (y < strip->begin || y >= strip->end) {
        strip->cut = strip->cut || (y >= 0 && y < output->reason.height);
        return;
    }
    uint8_t *reason = image_u8_row(&output->reason, y) + x;
    if (is_step(image_i32_row(&output->disparity_q8, y)[x], from_q8)) {
        return;
    }
    if (*reason == MARK_LARGE) {
        strip->large = true;
    } else if (*reason == REASON_VALID && strip->count < strip->limit) {
        *reason = MARK_QUEUED;
        strip->queue[strip->count++] = (struct place){(int16_t)x, (int16_t)y};
    }
}

// Grows the island around (x, y) until it ends, meets a large one or reaches the limit, and marks
// its pixels. Stopping at the limit keeps the work per pixel constant: the part found is marked as
// large, and so is anything that grows into it later.
static void measure_island(struct strip *strip, int x, int y) {
    struct match_output *output = strip->output;
    strip->count = 0;
    strip->large = false;
    strip->cut = false;
    visit(strip, image_i32_row(&output->disparity_q8, y)[x], x, y);
    for (int i = 0; i < strip->count && strip->count < strip->limit && !strip->large; i++) {
        const struct place at = strip->queue[i];
        const int32_t here_q8 = image_i32_row(&output->disparity_q8, at.y)[at.x];
        visit(strip, here_q8, at.x + 1, at.y);
        visit(strip, here_q8, at.x - 1, at.y);
        visit(strip, here_q8, at.x, at.y + 1);
        visit(strip, here_q8, at.x, at.y - 1);
    }
    const bool large = strip->large || strip->count == strip->limit;
    const uint8_t small = strip->cut ? MARK_UNDECIDED : match_rules[MATCH_ISLAND].reason;
    const uint8_t mark = large ? MARK_LARGE : small;
    for (int i = 0; i < strip->count; i++) {
        const struct place at = strip->queue[i];
        image_u8_row(&output->reason, at.y)[at.x] = mark;
        if (mark == MARK_UNDECIDED) {
            strip->undecided = with_row(strip->undecided, at.y);
        }
    }
}

// Divides row y into runs of valid pixels without a step, and of others. Loops without branches, so
// that compilers can vectorize them.
static void find_runs(const struct strip *strip, int y) {
    const struct match_output *output = strip->output;
    const uint8_t *restrict reason = image_u8_row(&output->reason, y);
    const int32_t *restrict here_q8 = image_i32_row(&output->disparity_q8, y);
    uint8_t *restrict stop = strip->stop;
    uint8_t *restrict joins = strip->joins;
    const int width = output->reason.width;
    stop[0] = 1;
    for (int x = 1; x < width; x++) {
        const bool valid = (reason[x] & ~MARK_LARGE) == REASON_VALID;
        const bool valid_before = (reason[x - 1] & ~MARK_LARGE) == REASON_VALID;
        stop[x] = (valid != valid_before) | (valid & is_step(here_q8[x], here_q8[x - 1]));
    }
    if (y == strip->begin) {
        memset(joins, 0, (size_t)width);
        return;
    }
    const uint8_t *restrict above = image_u8_row(&output->reason, y - 1);
    const int32_t *restrict above_q8 = image_i32_row(&output->disparity_q8, y - 1);
    for (int x = 0; x < width; x++) {
        joins[x] = (above[x] == MARK_LARGE) & !is_step(above_q8[x], here_q8[x]);
    }
}

// All pixels of a run belong to one island, or to none. Most runs are large or continue a large
// island, and need not be measured.
static void speckle_filter_run(struct strip *strip, int y, int begin, int end) {
    uint8_t *run = image_u8_row(&strip->output->reason, y) + begin;
    const size_t length = (size_t)(end - begin);
    if (*run != REASON_VALID && *run != MARK_LARGE) {
        return;
    }
    const bool known = end - begin >= strip->limit ||
                       memchr(strip->joins + begin, 1, length) != NULL ||
                       memchr(run, MARK_LARGE, length) != NULL;
    if (!known) {
        measure_island(strip, begin, y);
    }
    if (known || *run == MARK_LARGE) {
        memset(run, MARK_LARGE, length);
    }
}

static void speckle_filter_rows(struct strip *strip, int begin, int end) {
    const int width = strip->output->reason.width;
    for (int y = begin; y < end; y++) {
        find_runs(strip, y);
        int run_end;
        for (int x = 0; x < width; x = run_end) {
            const uint8_t *next = memchr(strip->stop + x + 1, 1, (size_t)(width - x - 1));
            run_end = next == NULL ? width : (int)(next - strip->stop);
            speckle_filter_run(strip, y, x, run_end);
        }
    }
}

static void replace_marks(struct match_output *output, int begin, int end, uint8_t mark) {
    const int width = output->reason.width;
    for (int y = begin; y < end; y++) {
        uint8_t *restrict reason = image_u8_row(&output->reason, y);
        for (int x = 0; x < width; x++) {
            reason[x] = reason[x] == mark ? (uint8_t)REASON_VALID : reason[x];
        }
    }
}

static void speckle_filter_part(void *context, int index) {
    struct strip *strip = &((struct filtering *)context)->strip[index];
    speckle_filter_rows(strip, strip->begin, strip->end);
}

static void unmark_part(void *context, int index) {
    const struct strip *strip = &((struct filtering *)context)->strip[index];
    replace_marks(strip->output, strip->begin, strip->end, MARK_LARGE);
}

// Rows of undecided islands on both sides of the seam above a strip. They reach no farther than the
// limit.
static struct rows seam_rows(const struct filtering *filtering, int index) {
    const struct strip *above = &filtering->strip[index - 1];
    const struct strip *below = &filtering->strip[index];
    const int height = filtering->output->reason.height;
    const int limit = filtering->limit < height ? filtering->limit : height;
    const int first = below->begin - limit;
    const int end = below->begin + limit;
    struct rows rows = {
        above->undecided.begin < below->undecided.begin ? above->undecided.begin
                                                        : below->undecided.begin,
        above->undecided.end > below->undecided.end ? above->undecided.end : below->undecided.end};
    rows.begin = rows.begin > first ? rows.begin : first;
    rows.end = rows.end < end ? rows.end : end;
    return rows;
}

// Decides the islands on both sides of a seam. All of them must be unmarked before, as an island
// may cross several.
static void speckle_filter_seams(const struct filtering *filtering) {
    struct strip whole = filtering->strip[0];
    whole.end = filtering->output->reason.height;
    for (int i = 1; i < filtering->parts; i++) {
        const struct rows rows = seam_rows(filtering, i);
        replace_marks(filtering->output, rows.begin, rows.end, MARK_UNDECIDED);
    }
    for (int i = 1; i < filtering->parts; i++) {
        const struct rows rows = seam_rows(filtering, i);
        speckle_filter_rows(&whole, rows.begin, rows.end);
    }
}

static void take_strips(struct match_memory *memory, int width, struct filtering *filtering) {
    for (int i = 0; i < filtering->parts; i++) {
        struct strip *strip = &filtering->strip[i];
        strip->queue = match_take(memory, (size_t)filtering->limit, sizeof *strip->queue);
        strip->stop = match_take(memory, (size_t)width, 1);
        strip->joins = match_take(memory, (size_t)width, 1);
    }
}

size_t speckle_filter_need_bytes(int width, int speckle_px, int threads) {
    struct filtering filtering = {.limit = speckle_px, .parts = part_count(threads)};
    struct match_memory memory = {0};
    take_strips(&memory, width, &filtering);
    return memory.need_bytes;
}

int speckle_filter_run_all(int speckle_px, const struct parallel *parallel, struct arena *arena,
                           struct match_output *output) {
    INVARIANT(speckle_px >= 0);
    INVARIANT(output->reason.width <= IMAGE_MAX_SIDE_PX);
    if (speckle_px < 2) {
        return ERROR_OK;
    }
    const size_t mark = arena_mark(arena);
    struct filtering filtering = {.output = output, .limit = speckle_px};
    filtering.parts = part_count(parallel->threads);
    const int height = output->reason.height;
    for (int i = 0; i < filtering.parts; i++) {
        filtering.strip[i] = (struct strip){.output = output,
                                            .limit = speckle_px,
                                            .begin = height * i / filtering.parts,
                                            .end = height * (i + 1) / filtering.parts,
                                            .undecided = {height, 0}};
    }
    struct match_memory memory = {.arena = arena};
    take_strips(&memory, output->reason.width, &filtering);
    if (memory.failed) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    parallel->run(parallel->self, speckle_filter_part, &filtering, filtering.parts);
    speckle_filter_seams(&filtering);
    parallel->run(parallel->self, unmark_part, &filtering, filtering.parts);
    arena_release(arena, mark);
    return ERROR_OK;
}

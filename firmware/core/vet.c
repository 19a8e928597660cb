// SPDX-License-Identifier: Apache-2.0
#include "core/vet.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/reason.h"

// Marks in the reason map while islands are being measured; above all reasons.
enum { MARK_QUEUED = 0x40, MARK_LARGE = 0x80 };

struct place {
    int16_t x, y;
};

struct island {
    struct match_output *output;
    struct place *queue;  // pixels of the island in the order they were found
    int count, limit;
    bool large;  // touches pixels already known to belong to a large island
};

size_t vet_need_bytes(int speckle_px) {
    return arena_need_bytes((size_t)speckle_px, sizeof(struct place));
}

static void visit(struct island *island, int32_t from_q8, int x, int y) {
    struct match_output *output = island->output;
    if (x < 0 || y < 0 || x >= output->reason.width || y >= output->reason.height) {
        return;
    }
    uint8_t *reason = image_u8_row(&output->reason, y) + x;
    const int32_t step_q8 = image_i32_row(&output->disparity_q8, y)[x] - from_q8;
    if (step_q8 > VET_ISLAND_STEP_Q8 || step_q8 < -VET_ISLAND_STEP_Q8) {
        return;
    }
    if (*reason == MARK_LARGE) {
        island->large = true;
    } else if (*reason == REASON_VALID && island->count < island->limit) {
        *reason = MARK_QUEUED;
        island->queue[island->count++] = (struct place){(int16_t)x, (int16_t)y};
    }
}

// Grows the island around (x, y) until it ends, meets a large one or reaches the limit, and
// marks its pixels. Stopping at the limit keeps the work per pixel constant: what was found is
// marked as large, and whatever grows into it later is large as well.
static void measure_island(struct island *island, int x, int y) {
    struct match_output *output = island->output;
    island->count = 0;
    island->large = false;
    visit(island, image_i32_row(&output->disparity_q8, y)[x], x, y);
    for (int i = 0; i < island->count && island->count < island->limit && !island->large; i++) {
        const struct place at = island->queue[i];
        const int32_t here_q8 = image_i32_row(&output->disparity_q8, at.y)[at.x];
        visit(island, here_q8, at.x + 1, at.y);
        visit(island, here_q8, at.x - 1, at.y);
        visit(island, here_q8, at.x, at.y + 1);
        visit(island, here_q8, at.x, at.y - 1);
    }
    const bool large = island->large || island->count == island->limit;
    const uint8_t mark = large ? MARK_LARGE : REASON_SPECKLE;
    for (int i = 0; i < island->count; i++) {
        image_u8_row(&output->reason, island->queue[i].y)[island->queue[i].x] = mark;
    }
}

static inline bool is_step(int32_t a_q8, int32_t b_q8) {
    return a_q8 - b_q8 > VET_ISLAND_STEP_Q8 || b_q8 - a_q8 > VET_ISLAND_STEP_Q8;
}

// First column from x on where the run of valid pixels without a step that begins at x ends.
static int run_end(const uint8_t *reason, const int32_t *disparity_q8, int x, int width) {
    int end = x + 1;
    while (end < width && reason[end] == REASON_VALID &&
           !is_step(disparity_q8[end], disparity_q8[end - 1])) {
        end++;
    }
    return end;
}

// Whether some pixel of row y in [begin, end) continues a large island in the row above.
static bool continues_large(const struct match_output *output, int y, int begin, int end) {
    const uint8_t *above = image_u8_row(&output->reason, y - 1);
    const int32_t *above_q8 = image_i32_row(&output->disparity_q8, y - 1);
    const int32_t *here_q8 = image_i32_row(&output->disparity_q8, y);
    for (int x = begin; x < end; x++) {
        if (above[x] == MARK_LARGE && !is_step(above_q8[x], here_q8[x])) {
            return true;
        }
    }
    return false;
}

// Most runs are large by themselves or continue a large island: no need to measure them.
static void vet_row(struct island *island, int y) {
    struct match_output *output = island->output;
    uint8_t *reason = image_u8_row(&output->reason, y);
    const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y);
    const int width = output->reason.width;
    int end;
    for (int x = 0; x < width; x = end) {
        end = x + 1;
        if (reason[x] != REASON_VALID) {
            continue;
        }
        end = run_end(reason, disparity_q8, x, width);
        const bool meets_large = (x > 0 && reason[x - 1] == MARK_LARGE &&
                                  !is_step(disparity_q8[x], disparity_q8[x - 1])) ||
                                 (end < width && reason[end] == MARK_LARGE &&
                                  !is_step(disparity_q8[end], disparity_q8[end - 1]));
        if (end - x >= island->limit || meets_large ||
            (y > 0 && continues_large(output, y, x, end))) {
            memset(reason + x, MARK_LARGE, (size_t)(end - x));
        } else {
            measure_island(island, x, y);
            end = x + 1;
        }
    }
}

int vet_speckles(int speckle_px, struct arena *arena, struct match_output *output) {
    INVARIANT(speckle_px >= 0);
    INVARIANT(output->reason.width <= IMAGE_MAX_SIDE_PX);
    if (speckle_px < 2) {
        return ERROR_OK;
    }
    const size_t mark = arena_mark(arena);
    struct island island = {.output = output, .limit = speckle_px};
    island.queue = arena_take(arena, (size_t)speckle_px, sizeof *island.queue);
    if (island.queue == NULL) {
        return ERROR_MEMORY;
    }
    for (int y = 0; y < output->reason.height; y++) {
        vet_row(&island, y);
    }
    for (int y = 0; y < output->reason.height; y++) {
        uint8_t *reason = image_u8_row(&output->reason, y);
        for (int x = 0; x < output->reason.width; x++) {
            reason[x] = reason[x] == MARK_LARGE ? REASON_VALID : reason[x];
        }
    }
    arena_release(arena, mark);
    return ERROR_OK;
}

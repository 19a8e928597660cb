// SPDX-License-Identifier: Apache-2.0
#include "core/vet.h"

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

static bool joined(const struct match_output *output, int32_t here_q8, int x, int y) {
    const int32_t step_q8 = image_i32_row(&output->disparity_q8, y)[x] - here_q8;
    return image_u8_row(&output->reason, y)[x] == MARK_LARGE && step_q8 <= VET_ISLAND_STEP_Q8 &&
           step_q8 >= -VET_ISLAND_STEP_Q8;
}

// Most pixels continue a large island to their left or above: no need to measure it again.
static bool continues_large(const struct match_output *output, int x, int y) {
    const int32_t here_q8 = image_i32_row(&output->disparity_q8, y)[x];
    return (x > 0 && joined(output, here_q8, x - 1, y)) ||
           (y > 0 && joined(output, here_q8, x, y - 1));
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
        for (int x = 0; x < output->reason.width; x++) {
            uint8_t *reason = image_u8_row(&output->reason, y) + x;
            if (*reason != REASON_VALID) {
                continue;
            }
            if (continues_large(output, x, y)) {
                *reason = MARK_LARGE;
            } else {
                measure_island(&island, x, y);
            }
        }
    }
    for (int y = 0; y < output->reason.height; y++) {
        uint8_t *reason = image_u8_row(&output->reason, y);
        for (int x = 0; x < output->reason.width; x++) {
            INVARIANT(reason[x] != MARK_QUEUED);
            if (reason[x] == MARK_LARGE) {
                reason[x] = REASON_VALID;
            }
        }
    }
    arena_release(arena, mark);
    return ERROR_OK;
}

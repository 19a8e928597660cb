// SPDX-License-Identifier: Apache-2.0
#include "console/measure/measure_share.h"

#include <string.h>

#include "core/invariant.h"
#include "stereo/surface.h"

// ---- which depths are the subject

enum { COARSE_PX = 512 };  // width of a surface that shows where the subject is

struct coarse {
    struct triangulate_point *points;
    uint32_t count, room, width_px, step;
};

static void keep_coarse(void *cookie, const struct surface_part *part) {
    struct coarse *self = cookie;
    for (uint32_t i = 0; i < part->vertex_count; i++) {
        const uint32_t x = part->vertex_pixel[i] % self->width_px;
        const uint32_t y = part->vertex_pixel[i] / self->width_px;
        if (x % self->step == 0 && y % self->step == 0) {
            INVARIANT(self->count < self->room);
            self->points[self->count++] = part->points[i];
        }
    }
}

static struct coarse coarse_of(const struct reconstruct_result *result) {
    struct coarse coarse = {.width_px = (uint32_t)result->plan.width_px};
    const uint32_t height_px = (uint32_t)result->plan.height_px;
    coarse.step = (coarse.width_px + COARSE_PX - 1) / COARSE_PX;
    coarse.room = (coarse.width_px / coarse.step + 1) * (height_px / coarse.step + 1);
    return coarse;
}

bool measure_share_find(const struct reconstruct_result *result,
                        const struct measure_subject_request *request, struct arena *arena,
                        struct measure_subject *subject) {
    const size_t mark = arena_mark(arena);
    struct coarse coarse = coarse_of(result);
    coarse.points = arena_take(arena, coarse.room, sizeof *coarse.points);
    if (coarse.points == NULL) {
        return false;
    }
    surface_walk(result, SURFACE_POINTS, keep_coarse, &coarse);
    const bool found = measure_subject_find(coarse.points, coarse.count, request, subject);
    arena_release(arena, mark);
    return found;
}

// ---- its pixels

enum kind {
    OTHER,  // than the subject: what is at its side
    HOLE,   // of the subject, if it is between its pixels
    SUBJECT,
};

// Fewer pixels of the subject in a line may be mistaken.
enum { RUN_MIN = 4 };

// A row or a column from its begin on.
struct line {
    uint32_t holes;  // since the last run of the subject
    uint8_t run;
    bool open;  // only holes followed that run
};

// Returns holes that the subject turns out to have.
static uint32_t continue_line(struct line *line, enum kind kind) {
    uint32_t missed = 0;
    if (kind != SUBJECT) {
        line->run = 0;
        line->open = line->open && kind == HOLE;
        line->holes = line->open ? line->holes + 1 : 0;
    } else if (line->run < RUN_MIN && ++line->run == RUN_MIN) {
        missed = line->holes;
        line->holes = 0;
        line->open = true;
    }
    return missed;
}

struct pixels {
    const struct reconstruct_result *result;
    const struct surface_figures_depths *depths;
    struct line *column;
    bool *within;  // the pixels of the row: whether their points are in the subject's depths
    uint32_t row, measured, row_missed, column_missed;
    uint32_t reason_count[REASON_COUNT];  // of those missed in rows
};

static enum kind kind_of(const struct pixels *self, uint8_t reason, uint32_t x) {
    if (reason == REASON_VALID) {
        return self->within[x] ? SUBJECT : OTHER;
    }
    return reason == REASON_BORDER || reason == REASON_BEYOND ? OTHER : HOLE;
}

static void end_row(struct pixels *self) {
    const uint32_t width = (uint32_t)self->result->plan.width_px;
    const uint8_t *reasons = image_u8_row(&self->result->match.reason, (int)self->row);
    struct line line = {.holes = 0};
    uint32_t pending[REASON_COUNT] = {0};
    for (uint32_t x = 0; x < width; x++) {
        const enum kind kind = kind_of(self, reasons[x], x);
        const uint32_t missed = continue_line(&line, kind);
        INVARIANT(reasons[x] < REASON_COUNT);
        pending[reasons[x]] += kind == HOLE && line.open;
        for (int reason = 0; reason < REASON_COUNT && line.holes == 0; reason++) {
            self->reason_count[reason] += missed > 0 ? pending[reason] : 0;
            pending[reason] = 0;
        }
        self->measured += kind == SUBJECT;
        self->row_missed += missed;
        self->column_missed += continue_line(&self->column[x], kind);
    }
    memset(self->within, 0, width * sizeof *self->within);
    self->row++;
}

static void take_points(void *cookie, const struct surface_part *part) {
    struct pixels *self = cookie;
    const uint32_t width = (uint32_t)self->result->plan.width_px;
    for (uint32_t i = 0; i < part->vertex_count; i++) {
        const uint32_t y = part->vertex_pixel[i] / width;
        while (self->row < y) {
            end_row(self);
        }
        const int32_t z_um = part->points[i].z_um;
        self->within[part->vertex_pixel[i] % width] =
            z_um >= self->depths->near_um && z_um <= self->depths->far_um;
    }
}

static enum reason most_of(const uint32_t *reason_count) {
    enum reason most = REASON_VALID;
    for (int reason = 0; reason < REASON_COUNT; reason++) {
        most = reason_count[reason] > reason_count[most] ? (enum reason)reason : most;
    }
    return most;
}

bool measure_share_of(const struct reconstruct_result *result,
                      const struct surface_figures_depths *depths, struct arena *arena,
                      struct measure_share *share) {
    const size_t width = (size_t)result->plan.width_px, mark = arena_mark(arena);
    struct pixels pixels = {.result = result,
                            .depths = depths,
                            .column = arena_take(arena, width, sizeof *pixels.column),
                            .within = arena_take(arena, width, sizeof *pixels.within)};
    memset(share, 0, sizeof *share);
    bool ok = pixels.column != NULL && pixels.within != NULL;
    if (ok) {
        memset(pixels.column, 0, width * sizeof *pixels.column);
        memset(pixels.within, 0, width * sizeof *pixels.within);
        surface_walk(result, SURFACE_POINTS, take_points, &pixels);
        while (pixels.row < (uint32_t)result->plan.height_px) {
            end_row(&pixels);
        }
        share->measured = pixels.measured;
        share->missed =
            pixels.row_missed > pixels.column_missed ? pixels.row_missed : pixels.column_missed;
        share->hole = most_of(pixels.reason_count);
        ok = pixels.measured == 0 ||
             surface_figures_find_spread(result, depths, pixels.measured, arena, &share->spread);
    }
    arena_release(arena, mark);
    return ok;
}

size_t measure_share_need_bytes(const struct reconstruct_result *result) {
    const size_t width = (size_t)result->plan.width_px;
    const size_t coarse =
        arena_need_bytes(coarse_of(result).room, sizeof(struct triangulate_point));
    const size_t lines = arena_need_bytes(width, sizeof(struct line)) +
                         arena_need_bytes(width, sizeof(bool)) +
                         surface_figures_spread_need_bytes();
    return coarse > lines ? coarse : lines;
}

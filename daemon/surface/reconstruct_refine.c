// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_refine.h"

#include <math.h>
#include <stdlib.h>

#include "core/error.h"
#include "daemon/session/calibration_at.h"
#include "stereo/develop.h"

enum { STRIP_ROWS = 64 };

/// Nearer than anything that both cameras see.
static const double nearest_mm = 300;

/// Develops one frame to grey; its colour is dropped strip by strip.
static int develop_grey(const struct raw_image *raw, const struct arena *free, uint8_t *pixels,
                        struct image_u8 *grey) {
    struct arena arena = *free;
    struct develop_state develop;
    const struct develop_balance balance = {
        {DEVELOP_BALANCE_ONE, DEVELOP_BALANCE_ONE, DEVELOP_BALANCE_ONE}};
    const int width = raw->width_px, height = raw->height_px;
    uint8_t *strip = arena_take(&arena, (size_t)width * STRIP_ROWS, 3);
    if (strip == NULL) {
        return ERROR_MEMORY;
    }
    const int error = develop_begin(&develop, raw, &balance, 1, &arena);
    for (int row = 0; error == ERROR_OK && row < height; row += STRIP_ROWS) {
        const int rows = height - row < STRIP_ROWS ? height - row : STRIP_ROWS;
        struct image_u8 part = {pixels + (size_t)row * (size_t)width, width, rows, width};
        struct image_rgb8 colour = {strip, width, rows, (ptrdiff_t)3 * width};
        develop_rows(&develop, &parallel_serial, row, &part, &colour);
    }
    *grey = (struct image_u8){pixels, width, height, width};
    return error;
}

static size_t need_bytes(const struct pair *pair) {
    size_t bytes = 0;
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct raw_image *raw = &pair->frame[side].image;
        const size_t width = (size_t)raw->width_px, height = (size_t)raw->height_px;
        const size_t developing =
            arena_need_bytes(width * STRIP_ROWS, 3) + develop_need_bytes(raw->width_px, 16, 1);
        const size_t refining = refine_calibration_need_bytes(raw->width_px, raw->height_px);
        const size_t larger = developing > refining ? developing : refining;
        bytes += arena_need_bytes(width * height, 1) + larger;
    }
    return bytes;
}

static int refine(const struct zoom_calibration *zoom, const struct pair *pair,
                  struct refine_picture *picture, struct arena *arena,
                  struct calibration *calibration, struct refine_report *report,
                  struct calibration_fault *fault) {
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct pair_frame *frame = &pair->frame[side];
        picture->window[side] = (struct calibration_window){
            frame->window.column_px, frame->window.row_px, frame->window.skip};
        uint8_t *pixels =
            arena_take(arena, (size_t)frame->image.width_px * (size_t)frame->image.height_px, 1);
        const int error = pixels == NULL
                              ? ERROR_MEMORY
                              : develop_grey(&frame->image, arena, pixels, &picture->grey[side]);
        if (error != ERROR_OK) {
            return error;
        }
    }
    return refine_calibration(zoom, picture, arena, calibration, report, fault);
}

int reconstruct_refine(const struct zoom_calibration *zoom, const struct zoom_state *state,
                       const struct pair *pair, const double depth_mm[2],
                       struct calibration *calibration, struct refine_report *report,
                       struct message *message) {
    struct refine_picture picture = {
        .axes = *state,
        .depth_near_mm = depth_mm[0] > 0 ? depth_mm[0] : nearest_mm,
        .depth_far_mm = depth_mm[1] > 0 ? depth_mm[1] : INFINITY,
    };
    struct calibration_fault fault = {.field = "", .reason = ""};
    const size_t bytes = need_bytes(pair);
    void *memory = malloc(bytes);
    struct arena arena;
    arena_init(&arena, memory, memory == NULL ? 0 : bytes);
    const int error = refine(zoom, pair, &picture, &arena, calibration, report, &fault);
    free(memory);
    return error == ERROR_OK ? ERROR_OK
                             : calibration_at_refused("the calibration cannot be refined", error,
                                                      &fault, message);
}

void reconstruct_refine_doubt(struct reconstruct_context *context) {
    const struct refine_report *report = &context->self_calibration;
    if (report->used == 0) {
        reconstruct_context_warn(context,
                                 "only %d points of the pair match: the cameras are taken to be "
                                 "where the motors read, and all depths share a deviation of %.3g "
                                 "mm at %.0f mm (more texture, or \"calibrate touch-up\")",
                                 report->matches, report->depth.after, report->depth_mm);
    } else if (report->health == REFINE_CALIBRATE) {
        reconstruct_context_warn(context,
                                 "the cameras are not where the calibration expects them (%.1f "
                                 "standard deviations, rows %.2f px apart): calibrate again",
                                 report->surprise, report->rows_px);
    }
}

// SPDX-License-Identifier: Apache-2.0
#include "console/pair/pair_adjust.h"

#include <math.h>
#include <string.h>

#include "console/pair/calibration_at.h"
#include "core/error.h"
#include "core/math.h"
#include "stereo/develop.h"

enum { STRIP_ROWS = 64 };

// Nearer than anything that both cameras see.
static const double nearest_mm = 300;

// Develops one frame to grey; its colour is dropped strip by strip.
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

static size_t larger(size_t one, size_t other) {
    return one > other ? one : other;
}

size_t pair_adjust_need_bytes(const struct pair *const *pairs, int count,
                              const struct adjust_target *target) {
    size_t bytes = arena_need_bytes(target != NULL ? (size_t)target->observations : 0,
                                    sizeof *target->observation);
    size_t most = 0;
    for (int i = 0; i < count; i++) {
        for (int side = 0; side < RIG_SIDES; side++) {
            const struct raw_image *raw = &pairs[i]->frame[side].image;
            const size_t width = (size_t)raw->width_px, height = (size_t)raw->height_px;
            const size_t developing =
                arena_need_bytes(width * STRIP_ROWS, 3) + develop_need_bytes(raw->width_px, 16, 1);
            const size_t refining =
                count > 1
                    ? adjustment_need_bytes(2) + wide_pair_need_bytes(raw->width_px, raw->height_px)
                    : adjust_calibration_need_bytes(raw->width_px, raw->height_px);
            bytes += arena_need_bytes(width * height, 1);
            most = larger(most, larger(developing, refining));
        }
    }
    return bytes + most;
}

static int make_picture(const struct pair *pair, const struct zoom_state *state, double near_mm,
                        struct arena *arena, struct adjust_picture *picture) {
    *picture = (struct adjust_picture){
        .axes = *state,
        .depth_near_mm = near_mm > 0 ? near_mm : nearest_mm,
        .depth_far_mm = INFINITY,
    };
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
    return ERROR_OK;
}

// Robust weights let go of what no place explains; corners and marks are seen within this.
static const double target_off_max_px = 3;

static int refuse_target(struct calibration_fault *fault) {
    fault->reason = "the board or the length does not fit it (check its size and the marks)";
    return ERROR_MISMATCH;
}

// Places a thing of known size, whose observations are those of the pair's two views, at `state`
// of the adjustment, and corrects the cameras by it; they keep to it from here on.
static int fit_target(const struct adjust_target *target, int state, struct arena *arena,
                      struct adjustment *adjustment, struct adjust_target *placed,
                      struct calibration_fault *fault) {
    // Of standard deviations: robust weights must not take the calibration's own error for
    // outliers.
    static const double from_far_to_near[] = {100, 50, 25, 12, 6, 3, 1.5, 1};
    enum { STEPS = sizeof from_far_to_near / sizeof from_far_to_near[0] };
    if (target == NULL) {
        return ERROR_OK;
    }
    struct target_observation *seen = arena_take(arena, (size_t)target->observations, sizeof *seen);
    if (seen == NULL) {
        return ERROR_MEMORY;
    }
    *placed = *target;
    placed->observation = seen;
    for (int i = 0; i < target->observations; i++) {
        seen[i] = target->observation[i];
        seen[i].view = adjust_view(state, target->observation[i].view);
    }
    adjustment->target = placed;
    for (int i = 0; i < STEPS; i++) {
        placed->sigma_px = from_far_to_near[i] * target->sigma_px;
        if (!adjust_target_place(adjustment->view, placed)) {
            return refuse_target(fault);
        }
        (void)adjustment_solve(adjustment, NULL, 0);
    }
    const bool fits =
        adjust_target_place(adjustment->view, placed) && placed->residual_px < target_off_max_px;
    return fits ? ERROR_OK : refuse_target(fault);
}

// Refines a pair by its own pictures, and by a thing of known size (NULL: none).
static int adjust_alone(const struct zoom_calibration *zoom, const struct adjust_picture *picture,
                        const struct adjust_target *target, const struct watch *watch,
                        struct arena *arena, struct calibration *calibration,
                        struct pair_adjust_report *report, struct calibration_fault *fault) {
    struct adjustment adjustment;
    struct adjust_target placed;
    int error = zoom_state_check(zoom, &picture->axes, fault);
    if (error == ERROR_OK) {
        error = adjustment_begin(zoom, &picture->axes, 1, arena, &adjustment);
        adjustment.watch = *watch;
    }
    if (error == ERROR_OK) {
        error = fit_target(target, 0, arena, &adjustment, &placed, fault);
    }
    if (error == ERROR_OK) {
        error = adjust_pair(picture, arena, &adjustment, &report->self_calibration);
    }
    return error == ERROR_OK ? adjust_conclude(zoom, picture, &adjustment,
                                               &report->self_calibration, calibration, fault)
                             : error;
}

// Refines `picture[0]` with the help of `picture[1]`, of the same scene at another zoom.
static int adjust_by_wide_pair(const struct zoom_calibration *zoom,
                               const struct adjust_picture picture[2],
                               const struct adjust_target *target, const struct watch *watch,
                               struct arena *arena, struct calibration *calibration,
                               struct pair_adjust_report *report, struct calibration_fault *fault) {
    struct adjust_target placed;
    struct adjust_picture by_zoom[2];  // the wider first
    struct zoom_state states[2];
    struct zoom_pair at[2];
    for (int i = 0; i < 2; i++) {
        const int error = zoom_state_check(zoom, &picture[i].axes, fault);
        if (error != ERROR_OK) {
            return error;
        }
        zoom_pair_at(zoom->camera, &picture[i].axes, &at[i]);
    }
    const int first = at[0].side[0].lens.fx_px > at[1].side[0].lens.fx_px;
    for (int i = 0; i < 2; i++) {
        by_zoom[i] = picture[i ^ first];
        by_zoom[i].state = i;
        states[i] = by_zoom[i].axes;
    }
    struct adjustment adjustment;
    int error = adjustment_begin(zoom, states, 2, arena, &adjustment);
    adjustment.watch = *watch;
    if (error == ERROR_OK) {
        error = fit_target(target, first, arena, &adjustment, &placed, fault);
    }
    if (error == ERROR_OK) {
        error = wide_pair_adjust(by_zoom, arena, &adjustment, &report->wide_pair);
    }
    if (error == ERROR_OK) {
        report->self_calibration = report->wide_pair.pair[first];
        error = adjust_conclude(zoom, &by_zoom[first], &adjustment, &report->self_calibration,
                                calibration, fault);
    }
    return error;
}

// By one or two pairs, and by a thing of known size in the first (NULL: none).
static int adjust_pictures(const struct zoom_calibration *zoom,
                           const struct adjust_picture *picture, int count,
                           const struct adjust_target *target, const struct watch *watch,
                           struct arena *arena, struct calibration *calibration,
                           struct pair_adjust_report *report, struct calibration_fault *fault) {
    const size_t mark = arena_mark(arena);
    int error = ERROR_OK;
    report->with_pair_used = false;
    if (count > 1) {
        error =
            adjust_by_wide_pair(zoom, picture, target, watch, arena, calibration, report, fault);
        report->with_pair_used = error == ERROR_OK && !wide_pair_turned(&report->wide_pair) &&
                                 report->wide_pair.carried > 0;
        arena_release(arena, mark);
    }
    if (error == ERROR_OK && !report->with_pair_used) {
        error = adjust_alone(zoom, picture, target, watch, arena, calibration, report, fault);
        arena_release(arena, mark);
    }
    return error;
}

static int adjust(const struct zoom_calibration *zoom, const struct pair *const *pairs,
                  const struct zoom_state *states, int count, const struct pair_adjust_scene *scene,
                  struct arena *arena, struct calibration *calibration,
                  struct pair_adjust_report *report, struct calibration_fault *fault) {
    struct adjust_picture picture[2];
    for (int i = 0; i < count; i++) {
        const int error = make_picture(pairs[i], &states[i], scene->near_mm, arena, &picture[i]);
        if (error != ERROR_OK) {
            return error;
        }
    }
    int error = adjust_pictures(zoom, picture, count, NULL, &scene->watch, arena, calibration,
                                report, fault);
    if (error == ERROR_OK && scene->target != NULL) {
        report->target_points = scene->target->points;
        report->without_target = report->self_calibration;
        error = adjust_pictures(zoom, picture, report->with_pair_used ? count : 1, scene->target,
                                &scene->watch, arena, calibration, report, fault);
    }
    return error;
}

int pair_adjust(const struct zoom_calibration *zoom, const struct pair *const *pairs,
                const struct zoom_state *states, int count, const struct pair_adjust_scene *scene,
                struct arena *arena, struct calibration *calibration,
                struct pair_adjust_report *report, struct message *message) {
    struct calibration_fault fault = {.field = "", .reason = ""};
    const size_t mark = arena_mark(arena);
    memset(report, 0, sizeof *report);
    report->with_pair = count > 1 ? pairs[1]->number : 0;
    const int error = adjust(zoom, pairs, states, count, scene, arena, calibration, report, &fault);
    arena_release(arena, mark);
    return error == ERROR_OK ? ERROR_OK
                             : calibration_at_refused("the calibration cannot be adjusted", error,
                                                      &fault, message);
}

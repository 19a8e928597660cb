// SPDX-License-Identifier: Apache-2.0
#include "rig/pair_frame.h"

#include "core/error.h"
#include "core/invariant.h"
#include "focus/exposure_search.h"
#include "rig/base/rig_error.h"
#include "rig/rig_camera.h"
#include "rig/trigger.h"

enum {
    // Noise beyond five sigma occurs in one square of a million; a moving object covers more.
    CHANGE_LIMIT_PERMILLE = 2,
};

void pair_release(struct pair_frame frames[RIG_SIDES]) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        raw_image_release(&frames[side].image);
    }
}

void pair_frame_assess(struct pair_frame *frame) {
    frame->picture = picture_stats_of(&frame->image);
    frame->has_picture = true;
}

static struct pair_window window_of(const struct rig *rig, unsigned side) {
    const struct mt9t001_window *window = &rig->camera[side].sensor.window;
    if (!rig->profile.bridge) {
        return (struct pair_window){.skip = 0};
    }
    INVARIANT(window->skip >= 1 && window->bin == 1);
    return (struct pair_window){window->column_px, window->row_px, window->skip};
}

int pair_keep_frame(struct rig *rig, unsigned side, struct hal_camera_frame *frame,
                    struct pair_frame *out) {
    const int error = rig_camera_check_size(rig, side, &frame->image);
    if (error != ERROR_OK || frame->faults != 0) {
        raw_image_release(&frame->image);
        return error;
    }
    INVARIANT(frame->image.stride >= (ptrdiff_t)raw_image_row_values(&frame->image));
    INVARIANT(out->image.release == NULL);
    *out = (struct pair_frame){
        .image = frame->image,
        .window = window_of(rig, side),
        .sequence = frame->sequence,
        .begin_us = frame->begin_us,
        .end_us = frame->end_us,
        .exposure_us = rig->camera[side].exposure_us,
        .gain_q3 = rig->camera[side].gain_q3,
    };
    return ERROR_OK;
}

int pair_take_frame(struct rig *rig, unsigned side, uint64_t not_before_us,
                    struct pair_frame *out) {
    struct hal_camera_frame frame = {.faults = 0};
    // One frame less in memory while the next one arrives.
    raw_image_release(&out->image);
    for (int attempt = 0; attempt < PAIR_FRAME_ATTEMPTS; attempt++) {
        int error = rig_camera_take(rig, side, not_before_us, &frame);
        if (error != ERROR_OK) {
            return error;
        }
        error = pair_keep_frame(rig, side, &frame, out);
        if (frame.faults == 0 || error != ERROR_OK) {
            return error;
        }
    }
    return rig_camera_torn(rig, side, frame.faults);
}

int pair_check_change(struct rig *rig, unsigned side, uint32_t change_permille) {
    INVARIANT(side < RIG_SIDES && change_permille <= PICTURE_STATS_MAX_PERMILLE);
    if (change_permille <= CHANGE_LIMIT_PERMILLE) {
        return ERROR_OK;
    }
    const int32_t half_us = (int32_t)rig_mains_half_us(&rig->profile);
    const int32_t numbers[] = {(int32_t)change_permille, half_us};
    const bool flickers = exposure_is_below_mains(half_us, rig->camera[side].exposure_us);
    return rig_part_error(rig, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_MOVED,
                          flickers
                              ? "# of 1000 parts of its picture changed: lamps flicker in "
                                "exposures below # us: close the iris; else keep scene and light "
                                "constant"
                              : "# of 1000 parts of its picture changed during the pair (keep "
                                "scene and light constant, then capture again)",
                          numbers);
}

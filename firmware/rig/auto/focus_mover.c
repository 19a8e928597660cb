// SPDX-License-Identifier: Apache-2.0
#include "rig/auto/focus_mover.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "rig/base/rig_error.h"
#include "rig/lens_read.h"
#include "rig/rig_camera.h"

enum {
    // Such lenses have wide peaks: most frames of a sweep and of a pass.
    SWEEP_FRAMES = 40,
    PASS_FRAMES = 16,
};

int focus_mover_check(struct rig *self, unsigned sides) {
    unsigned lenses = sides;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0 && focus_mover_steps(self, side) > 0) {
            lenses &= ~(1u << side);
        }
    }
    if (lenses != 0 || sides == 0) {
        return lens_read_ready(self, lenses, LENS_FOCUS);
    }
    return self->state == RIG_READY ? ERROR_OK : ERROR_NOT_READY;
}

unsigned focus_mover_steps(const struct rig *self, unsigned side) {
    INVARIANT(side < RIG_SIDES);
    const unsigned steps = self->camera[side].focus_steps;
    if (rig_has_lens(&self->profile, side)) {
        return 0;
    }
    return steps < RIG_CAMERA_PARTS ? steps : RIG_CAMERA_PARTS;
}

double focus_mover_position(const struct rig *self, unsigned side) {
    const unsigned steps = focus_mover_steps(self, side);
    INVARIANT(steps > 0);
    return math_round((double)self->camera[side].focus_part * steps / RIG_CAMERA_PARTS);
}

int focus_mover_go(struct rig *self, unsigned side, double position) {
    const unsigned steps = focus_mover_steps(self, side);
    int32_t applied = 0;
    INVARIANT(steps > 0);
    if (!(position >= 0 && position <= steps)) {
        return ERROR_RANGE;
    }
    return rig_focus_part(self, side, (int32_t)math_round(position * RIG_CAMERA_PARTS / steps),
                          &applied);
}

struct focus_search_options focus_mover_options(const struct rig *self, unsigned side) {
    const struct rig_rectangle *region = &self->camera[side].focus.region_px;
    return (struct focus_search_options){
        .max = focus_mover_steps(self, side),
        .tolerance = 1,
        .counts_per_frame = 1,
        .noise_ratio = 1,
        .region_px = region->width_px < region->height_px ? region->width_px : region->height_px,
    };
}

// Moves it from step to step, with a frame at each.
static int sweep(struct rig *self, unsigned side, const struct focus_step *step,
                 focus_mover_look *look, void *context) {
    const double from = focus_mover_position(self, side), way = step->position - from;
    const int most = step->leg == FOCUS_LEG_PASS ? PASS_FRAMES : SWEEP_FRAMES;
    const int frames =
        (int)math_max(1, math_min(math_ceil(fabs(way) / math_max(step->spacing, 1)), most));
    const struct focus_step one = {FOCUS_STEP_LOOK, step->leg, 0, 0, 1, false};
    for (int i = 0; i <= frames; i++) {
        int error = focus_mover_go(self, side, math_round(from + way * i / frames));
        if (error == ERROR_OK) {
            error = look(context, &one, focus_mover_position(self, side));
        }
        if (error != ERROR_OK) {
            return error;
        }
    }
    return ERROR_OK;
}

int focus_mover_carry_out(struct rig *self, unsigned side, const struct focus_step *step,
                          focus_mover_look *look, void *context, struct focus_event *event) {
    int error = ERROR_OK;
    INVARIANT(step->kind != FOCUS_STEP_END);
    if (step->kind == FOCUS_STEP_SWEEP) {
        error = sweep(self, side, step, look, context);
    } else if (step->kind == FOCUS_STEP_LOOK) {
        error = look(context, step, focus_mover_position(self, side));
    } else {
        error = focus_mover_go(self, side, math_round(step->position));
    }
    *event = (struct focus_event){.position = focus_mover_position(self, side), .deviation = 0.5};
    return error;
}

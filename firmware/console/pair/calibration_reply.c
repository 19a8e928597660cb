// SPDX-License-Identifier: Apache-2.0
#include "console/pair/calibration_reply.h"

#include "console/line/file_blocks.h"
#include "core/invariant.h"
#include "core/math.h"
#include "rig/base/rig_state.h"

const char *calibration_reply_axis_name(int axis) {
    static const char *const names[CALIBRATION_AXES] = {"pan", "zoom", "focus", "iris"};
    INVARIANT(axis >= 0 && axis < CALIBRATION_AXES);
    return names[axis];
}

const char *calibration_reply_axis_unit(int axis) {
    INVARIANT(axis >= 0 && axis < CALIBRATION_AXES);
    return axis == CALIBRATION_PAN ? "deg" : "counts";
}

/// Reports cameras and axis positions with which it was made; unknown ones are omitted.
static void show_origin(const struct command_call *call, const struct calibration_origin *origin) {
    if (origin->instrument[0] != '\0') {
        reply_text(call, "instrument", origin->instrument);
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct calibration_side_origin *at = &origin->side[side];
        reply_group_begin(call, rig_side_names[side], false);
        if (at->camera[0] != '\0') {
            reply_text(call, "camera", at->camera);
        }
        for (int axis = 0; axis < CALIBRATION_AXES; axis++) {
            if (at->axis[axis].kind == CALIBRATION_AXIS_KNOWN) {
                reply_number(call, calibration_reply_axis_name(axis), at->axis[axis].mean, 3,
                             calibration_reply_axis_unit(axis));
            }
        }
        reply_group_end(call);
    }
}

void calibration_reply_put(const struct command_call *call, const struct calibration *calibration) {
    reply_text(call, "id", calibration->id);
    file_blocks_reply_crc(call, calibration_crc(calibration));
    if (calibration->date[0] != '\0') {
        reply_text(call, "date", calibration->date);
    }
    reply_number(call, "baseline", calibration_baseline_mm(calibration), 3, "mm");
    if (calibration->depth_far_mm > 0) {
        reply_number(call, "depth_near", calibration->depth_near_mm, 1, "mm");
        reply_number(call, "depth_far", calibration->depth_far_mm, 1, "mm");
    }
    if (calibration->rms_px > 0) {
        reply_number(call, "rms", calibration->rms_px, 3, "px");
    }
    if (calibration->has_origin) {
        show_origin(call, &calibration->origin);
    }
}

/// Reports the ranges of a zoom calibration and how well it was checked.
void calibration_reply_put_zoom(const struct command_call *call,
                                const struct zoom_calibration *zoom) {
    reply_text(call, "id", zoom->id);
    if (zoom->date[0] != '\0') {
        reply_text(call, "date", zoom->date);
    }
    if (zoom->instrument[0] != '\0') {
        reply_text(call, "instrument", zoom->instrument);
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct zoom_camera *camera = &zoom->camera[side];
        reply_group_begin(call, rig_side_names[side], false);
        if (camera->name[0] != '\0') {
            reply_text(call, "camera", camera->name);
        }
        reply_number(call, "zoom_min", camera->zoom.min, 1, "counts");
        reply_number(call, "zoom_max", camera->zoom.max, 1, "counts");
        reply_number(call, "focus_min", camera->focus.min, 1, "counts");
        reply_number(call, "focus_max", camera->focus.max, 1, "counts");
        reply_number(call, "pan_min", camera->pan_rad.min * MATH_DEGREE_PER_RAD, 3, "deg");
        reply_number(call, "pan_max", camera->pan_rad.max * MATH_DEGREE_PER_RAD, 3, "deg");
        reply_group_end(call);
    }
    reply_number(call, "settings", zoom->validation.settings, 0, NULL);
    reply_number(call, "rms", zoom->validation.rms_px, 3, "px");
    if (zoom->validation.held_out_px > 0) {
        reply_number(call, "held_out", zoom->validation.held_out_px, 3, "px");
    }
}

// SPDX-License-Identifier: Apache-2.0
// Turns both cameras to a point, and finds the line of sight of a pixel, by the saved calibration
// of all zooms.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/measure/measure_rig.h"
#include "console/pair/calibration_at.h"
#include "core/math.h"
#include "daemon/commands/commands.h"
#include "measure/measure_place.h"
#include "stereo/zoom/zoom_aim.h"

enum { DISTANCE, RIGHT, ARGUMENTS };

int commands_view_ray(const struct command_call *call, const struct zoom_calibration *zoom,
                      const struct measure_request *request, struct measure_place *place) {
    const int *place_px = request->place_px;
    if (!request->has_place) {
        return ERROR_OK;
    }
    const struct daemon_view *view = &daemon_of(call)->view;
    const struct daemon_axes axes = daemon_axes_of(call->rig);
    struct zoom_state state;
    measure_rig_axes(&view->now, &state);
    if (!view->taken || call->rig->state != RIG_READY ||
        memcmp(&axes, &view->axes, sizeof axes) != 0) {
        return command_fail(call, ERROR_MISSING,
                            "measure: at needs a view, and %s (\"view\" first)",
                            view->taken ? "the cameras have moved since" : "none was taken");
    }
    for (int i = 0; i < RIG_SIDES; i++) {
        const struct zoom_camera_state *axes_of_side = &state.side[i];
        if (!isfinite(axes_of_side->pan_rad + axes_of_side->zoom_counts +
                      axes_of_side->focus_counts)) {
            return command_fail(call, ERROR_MISSING,
                                "measure: at needs motors that were set (\"aim distance=2000\", "
                                "\"zoom 1x\", then \"view\")");
        }
    }
    const int side = place_px[0] >= view->width_px;
    const int in_half_px[2] = {place_px[0] - side * view->width_px, place_px[1]};
    if (in_half_px[0] >= view->width_px || in_half_px[1] >= view->height_px) {
        return command_fail(call, ERROR_RANGE, "measure: at %d,%d is outside the view (%d x %d px)",
                            place_px[0], place_px[1], 2 * view->width_px, view->height_px);
    }
    const double pixel_px[2] = {view->column_px[side] + (in_half_px[0] + 0.5) * view->step_px - 0.5,
                                view->row_px[side] + (in_half_px[1] + 0.5) * view->step_px - 0.5};
    return measure_place_of(zoom, &state, side, pixel_px, place)
               ? ERROR_OK
               : command_fail(call, ERROR_RANGE, "measure: the lens has no ray for that pixel");
}

/// The state with the zooms as last read, in the middle of the range if they were not.
static struct zoom_state state_of(const struct rig *rig, const struct zoom_calibration *zoom) {
    struct zoom_state state;
    memset(&state, 0, sizeof state);
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct zoom_camera *camera = &zoom->camera[side];
        const int32_t read_q4 = rig->camera[side].lens.measured[LENS_ZOOM].position_q4;
        const double counts =
            read_q4 != INT32_MIN ? read_q4 / 16.0 : (camera->zoom.min + camera->zoom.max) / 2;
        state.side[side].zoom_counts = fmin(fmax(counts, camera->zoom.min), camera->zoom.max);
        state.side[side].focus_counts = camera->focus.min;
    }
    return state;
}

/// Runs "pan", so that a recording contains it and can be replayed without the store.
static int turn(const struct command_call *call, const struct zoom_state *state) {
    char line[64];
    const double left_deg = state->side[RIG_LEFT].pan_rad * MATH_DEGREE_PER_RAD;
    const double right_deg = state->side[RIG_RIGHT].pan_rad * MATH_DEGREE_PER_RAD;
    snprintf(line, sizeof line, "pan %.4f right=%.4f", left_deg, right_deg);
    const int error = command_give(call, line, NULL);
    if (error == ERROR_OK) {
        reply_number(call, "left", left_deg, 3, "deg");
        reply_number(call, "right", right_deg, 3, "deg");
    }
    return error;
}

static int run_aim(const struct command_call *call) {
    struct zoom_calibration *zoom;
    struct calibration_fault fault;
    double point_mm[3];
    bool accepted = false;
    if (!call->values[DISTANCE].given) {
        return command_fail(call, ERROR_MISSING, "aim: distance=MM is required");
    }
    int error = commands_calibration_zoom(call, &zoom, &accepted);
    if (error != ERROR_OK) {
        return error;
    }
    struct zoom_state state = state_of(call->rig, zoom);
    zoom_point_ahead(zoom, call->values[DISTANCE].number,
                     call->values[RIGHT].given ? call->values[RIGHT].number : 0, point_mm);
    error = zoom_aim(zoom, point_mm, &state, &fault);
    if (error != ERROR_OK) {
        const int side = strcmp(fault.field, "left_pan_rad") == 0 ? RIG_LEFT : RIG_RIGHT;
        const struct zoom_range range = zoom->camera[side].pan_rad;
        free(zoom);
        return command_fail(call, error,
                            "aim: the %s camera would have to turn beyond its calibrated %.3f to "
                            "%.3f deg (choose a point farther away or nearer to the middle)",
                            rig_side_names[side], range.min * MATH_DEGREE_PER_RAD,
                            range.max * MATH_DEGREE_PER_RAD);
    }
    free(zoom);
    return turn(call, &state);
}

static const struct command_argument arguments[ARGUMENTS] = {
    {.name = "distance",
     .kind = COMMAND_NUMBER,
     .min = 100,
     .max = 1e6,
     .unit = "mm",
     .help = "of the point, in front of the middle between the cameras"},
    {.name = "right",
     .kind = COMMAND_NUMBER,
     .min = -1e6,
     .max = 1e6,
     .unit = "mm",
     .help = "of the point, to the right of the middle; default: 0"},
};

static const struct command commands[] = {
    {.name = "aim",
     .summary = "turn both cameras to a point",
     .help = "Example: aim distance=1800 right=-50. Uses the saved calibration of all zooms "
             "(\"calibration set FILE\"), which knows the pan axes; there is no tilt. Waits until "
             "the cameras have stopped.",
     .arguments = arguments,
     .argument_count = ARGUMENTS,
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_UNRECORDED |
              COMMAND_GROUP_MOVE | COMMAND_DAILY,
     .run = run_aim},
};

const struct command *commands_aim_table(size_t *count) {
    *count = 1;
    return commands;
}

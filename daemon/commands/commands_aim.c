// SPDX-License-Identifier: Apache-2.0
// Turns both cameras to a point by the saved calibration of all zooms.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math.h"
#include "daemon/commands/commands.h"
#include "daemon/session/calibration_at.h"
#include "stereo/zoom/zoom_aim.h"

enum { DISTANCE, RIGHT, ARGUMENTS };

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
    if (!call->values[DISTANCE].given) {
        return command_fail(call, ERROR_MISSING, "aim: distance=MM is required");
    }
    int error = commands_calibration_zoom(call, &zoom);
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

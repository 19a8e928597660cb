// SPDX-License-Identifier: Apache-2.0
// Commands for camera settings: exposure, gain, window.
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/rig.h"

// 0: never set here, so the camera decides.
static void show(const struct command_call *call, unsigned side, double value, int decimals,
                 const char *unit) {
    if (value == 0) {
        reply_text(call, commands_side_name(side), "not set");
    } else {
        reply_number(call, commands_side_name(side), value, decimals, unit);
    }
}

int commands_camera_exposure(const struct command_call *call) {
    const unsigned sides = commands_sides(&call->values[1]);
    uint32_t applied_us = 0;
    int error = 0;
    if (call->values[0].given) {
        INVARIANT(call->values[0].integer > 0 && call->values[0].integer <= UINT32_MAX);
        error = rig_exposure(call->rig, sides, (uint32_t)call->values[0].integer, &applied_us);
    }
    for (unsigned side = 0; error == 0 && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            show(call, side, call->rig->camera[side].exposure_us, 0, "us");
        }
    }
    return error;
}

int commands_camera_gain(const struct command_call *call) {
    const unsigned sides = commands_sides(&call->values[1]);
    int error = 0;
    if (call->values[0].given) {
        const double gain_q3 = call->values[0].number * 8 + 0.5;
        INVARIANT(gain_q3 > 0 && gain_q3 <= UINT16_MAX);
        uint16_t applied_q3 = 0;
        error = rig_gain(call->rig, sides, (uint16_t)gain_q3, &applied_q3);
    }
    for (unsigned side = 0; error == 0 && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            show(call, side, call->rig->camera[side].gain_q3 / 8.0, 3, NULL);
        }
    }
    return error;
}

// Whether the sensors behind the bridge support this window size in one direction.
static int check_size(const struct command_call *call, unsigned which, const char *name,
                      int64_t skip, int32_t all_px) {
    enum { MIN_PX = 16 };
    const int64_t size_px = call->values[which].integer;
    const int64_t step_px = 2 * skip;
    const int64_t min_px = (MIN_PX + step_px - 1) / step_px * step_px;
    const int64_t max_px = all_px / step_px * step_px;
    if (size_px >= min_px && size_px <= max_px && size_px % step_px == 0) {
        return 0;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_join(&sentence, "window: ", name, " ");
    command_text_add_integer(&sentence, size_px);
    command_text_add(&sentence, " is not supported (expected with skip=");
    command_text_add_integer(&sentence, skip);
    command_text_add(&sentence, ": ");
    command_text_add_integer(&sentence, min_px);
    command_text_add(&sentence, " to ");
    command_text_add_integer(&sentence, max_px);
    command_text_add(&sentence, " px in steps of ");
    command_text_add_integer(&sentence, step_px);
    command_text_add(&sentence, ")");
    return ERROR_RANGE;
}

static int check_window(const struct command_call *call, int64_t skip) {
    if (call->rig->profile.bridge) {
        const int error = check_size(call, 0, "WIDTH", skip, MT9T001_WIDTH_PX);
        return error != 0 ? error : check_size(call, 1, "HEIGHT", skip, MT9T001_HEIGHT_PX);
    }
    if (skip == 1) {
        return 0;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_add(&sentence, "window: skip=");
    command_text_add_integer(&sentence, skip);
    command_text_add(&sentence, ": cameras without a bridge cannot skip pixels (leave skip out)");
    return ERROR_UNSUPPORTED;
}

int commands_camera_window(const struct command_call *call) {
    const struct command_value *values = call->values;
    int error = 0;
    if (values[0].given && !values[1].given) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "window: HEIGHT is missing (expected WIDTH HEIGHT [skip=N])");
        return ERROR_MISSING;
    }
    if (values[0].given) {
        const int64_t skip = values[2].given ? values[2].integer : 1;
        INVARIANT(skip >= 1 && skip <= UINT8_MAX);
        error = check_window(call, skip);
        error = error != 0 ? error
                           : rig_window(call->rig, (uint16_t)values[0].integer,
                                        (uint16_t)values[1].integer, (uint8_t)skip);
    }
    if (error == 0) {
        reply_number(call, "width", call->rig->format.width_px, 0, "px");
        reply_number(call, "height", call->rig->format.height_px, 0, "px");
    }
    return error;
}

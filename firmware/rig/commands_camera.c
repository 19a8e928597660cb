// SPDX-License-Identifier: Apache-2.0
// What the cameras are set to: exposure, gain, window.
#include "core/error.h"
#include "core/invariant.h"
#include "rig/commands.h"
#include "rig/rig.h"

static void show_exposure(const struct command_call *call, unsigned sides) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            commands_put_number(call, commands_side_name(side), call->rig->exposure_us[side], 0,
                                "us");
        }
    }
}

int commands_camera_exposure(const struct command_call *call) {
    const unsigned sides = commands_sides(&call->values[0]);
    uint32_t applied_us = 0;
    int error = 0;
    if (call->values[1].given) {
        INVARIANT(call->values[1].integer > 0 && call->values[1].integer <= UINT32_MAX);
        error = rig_exposure(call->rig, sides, (uint32_t)call->values[1].integer, &applied_us);
    }
    if (error == 0) {
        show_exposure(call, sides);
    }
    return error;
}

int commands_camera_gain(const struct command_call *call) {
    const unsigned sides = commands_sides(&call->values[0]);
    int error = 0;
    if (call->values[1].given) {
        const double gain_q3 = call->values[1].number * 8 + 0.5;
        INVARIANT(gain_q3 > 0 && gain_q3 <= UINT16_MAX);
        uint16_t applied_q3 = 0;
        error = rig_gain(call->rig, sides, (uint16_t)gain_q3, &applied_q3);
    }
    for (unsigned side = 0; error == 0 && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            commands_put_number(call, commands_side_name(side), call->rig->gain_q3[side] / 8.0, 3,
                                NULL);
        }
    }
    return error;
}

int commands_camera_window(const struct command_call *call) {
    const struct command_value *values = call->values;
    int error = 0;
    if (values[0].given && !values[1].given) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "window: HEIGHT is missing");
        return ERROR_MISSING;
    }
    if (values[0].given) {
        const int64_t skip = values[2].given ? values[2].integer : 1;
        INVARIANT(skip >= 1 && skip <= UINT8_MAX);
        error = rig_window(call->rig, (uint16_t)values[0].integer, (uint16_t)values[1].integer,
                           (uint8_t)skip);
    }
    if (error == 0) {
        commands_put_number(call, "width", call->rig->format.width_px, 0, "px");
        commands_put_number(call, "height", call->rig->format.height_px, 0, "px");
    }
    return error;
}

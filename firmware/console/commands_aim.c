// SPDX-License-Identifier: Apache-2.0
// The command pan.
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "rig/rig.h"

enum { ANGLE_DECIMALS = 3 };

static const double urad_per_degree = 1e6 * MATH_RAD_PER_DEGREE;

static int show_pan(const struct command_call *call, unsigned sides) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        int32_t angle_urad = 0;
        if ((sides >> side & 1) == 0) {
            continue;
        }
        const int error = rig_pan_read(call->rig, side, &angle_urad);
        if (error != ERROR_OK) {
            return error;
        }
        reply_number(call, commands_side_name(side), (double)angle_urad / urad_per_degree,
                     ANGLE_DECIMALS, "deg");
    }
    return ERROR_OK;
}

/// Converts an argument to an angle and checks it against the limits of this instrument.
static int angle_of(const struct command_call *call, const struct command_value *value,
                    const char *name, int32_t *angle_urad) {
    const struct rig_profile *profile = &call->rig->profile;
    const double exact_urad = value->number * urad_per_degree;
    // Rounds first, so that a limit itself, typed with limited digits, is accepted.
    const int64_t urad = (int64_t)(exact_urad < 0 ? exact_urad - 0.5 : exact_urad + 0.5);
    if (urad < profile->pan_min_urad || urad > profile->pan_max_urad) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, name);
        command_text_add_typed(&sentence, value->text);
        command_text_add(&sentence, " is out of range (expected ");
        command_text_add_number(&sentence, profile->pan_min_urad / urad_per_degree, ANGLE_DECIMALS);
        command_text_add(&sentence, " to ");
        command_text_add_number(&sentence, profile->pan_max_urad / urad_per_degree, ANGLE_DECIMALS);
        command_text_add(&sentence, " deg)");
        return ERROR_RANGE;
    }
    *angle_urad = (int32_t)urad;
    return ERROR_OK;
}

int commands_aim_pan(const struct command_call *call) {
    const unsigned sides = commands_sides(&call->values[1]);
    INVARIANT(sides > 0 && sides <= 3);
    if (!call->rig->profile.servos) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "this instrument has no pan servos");
        return ERROR_NOT_CONNECTED;
    }
    if (call->values[2].given && (sides != 3 || !call->values[0].given)) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "pan: right requires ANGLE, and no side");
        return ERROR_ARGUMENT;
    }
    if (!call->values[0].given) {
        return show_pan(call, sides);
    }
    int32_t first_urad = 0;
    int error = angle_of(call, &call->values[0], "pan: ANGLE ", &first_urad);
    if (error != ERROR_OK) {
        return error;
    }
    int32_t second_urad = first_urad;
    if (call->values[2].given) {
        error = angle_of(call, &call->values[2], "pan: right=", &second_urad);
    }
    if (error == ERROR_OK) {
        error = sides == 3 ? rig_pan_both(call->rig, first_urad, second_urad)
                           : rig_pan(call->rig, sides - 1, first_urad);
    }
    return error != ERROR_OK ? error : show_pan(call, sides);
}

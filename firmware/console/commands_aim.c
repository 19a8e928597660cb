// SPDX-License-Identifier: Apache-2.0
// Commands for pan and lens axes: pan, zoom, focus, iris.
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/lens_move.h"
#include "rig/rig.h"

enum { ANGLE_DECIMALS = 3 };

static const double urad_per_degree = 1e6 * 3.14159265358979323846 / 180.0;

static int show_pan(const struct command_call *call, unsigned sides) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        int32_t angle_urad = 0;
        if ((sides >> side & 1) == 0) {
            continue;
        }
        const int error = rig_pan_read(call->rig, side, &angle_urad);
        if (error != 0) {
            return error;
        }
        reply_number(call, commands_side_name(side), (double)angle_urad / urad_per_degree,
                     ANGLE_DECIMALS, "deg");
    }
    return 0;
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
    return 0;
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
    if (error != 0) {
        return error;
    }
    int32_t second_urad = first_urad;
    if (call->values[2].given) {
        error = angle_of(call, &call->values[2], "pan: right=", &second_urad);
    }
    if (error == 0) {
        error = sides == 3 ? rig_pan_both(call->rig, first_urad, second_urad)
                           : rig_pan(call->rig, sides - 1, first_urad);
    }
    return error != 0 ? error : show_pan(call, sides);
}

/// The sides meant: if none was named, all that have a lens.
static int lens_sides(const struct command_call *call, unsigned *sides) {
    const struct rig_profile *profile = &call->rig->profile;
    *sides = commands_sides(&call->values[1]);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((*sides >> side & 1) != 0 && !rig_has_lens(profile, side)) {
            if (!call->values[1].given && rig_has_lens(profile, RIG_LEFT)) {
                *sides &= ~(1U << side);
                continue;
            }
            struct command_text sentence = commands_sentence(call);
            command_text_join(&sentence, "no motorized lens on the ", commands_side_name(side));
            return ERROR_NOT_CONNECTED;
        }
    }
    return 0;
}

static int check_position(const struct command_call *call, unsigned side, enum lens_axis axis) {
    struct lens_limits limits;
    const int error = rig_lens_limits(call->rig, side, axis, &limits);
    if (error != 0) {
        return error;
    }
    const int64_t position = call->values[0].integer;
    if (position >= limits.min && position <= limits.max) {
        return 0;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_join(&sentence, lens_axis_names[axis], ": POSITION ");
    command_text_add_integer(&sentence, position);
    command_text_join(&sentence, " is out of range (expected for the ", commands_side_name(side),
                      " lens: ");
    command_text_add_integer(&sentence, limits.min);
    command_text_add(&sentence, " to ");
    command_text_add_integer(&sentence, limits.max);
    command_text_add(&sentence, " counts)");
    return ERROR_RANGE;
}

/// Adds a note where a lens was sent to a target that it cannot approach from its side.
static void put_play(const struct command_call *call, enum lens_axis axis) {
    const struct lens_axis_settings *settings = &call->rig->profile.lens.axis[axis];
    if (!call->values[0].given || lens_move_has_room(settings, (int32_t)call->values[0].integer)) {
        return;
    }
    reply_text(call, "note",
               settings->approach == LENS_FROM_BELOW
                   ? "too close to the lower limit for an approach from below: the motor's play "
                     "remains"
                   : "too close to the upper limit for an approach from above: the motor's play "
                     "remains");
    reply_number(call, "play", settings->backlash_counts, 0, "counts");
}

static int show_axis(const struct command_call *call, unsigned side, enum lens_axis axis) {
    int32_t positions[LENS_AXES];
    struct lens_limits limits;
    int error = rig_lens_read(call->rig, side, positions);
    if (error == 0) {
        error = rig_lens_limits(call->rig, side, axis, &limits);
    }
    if (error == 0) {
        reply_group_begin(call, commands_side_name(side), false);
        reply_number(call, "position", positions[axis], 0, "counts");
        reply_number(call, "min", limits.min, 0, "counts");
        reply_number(call, "max", limits.max, 0, "counts");
        put_play(call, axis);
        reply_group_end(call);
    }
    return error;
}

static int run_axis(const struct command_call *call, enum lens_axis axis) {
    unsigned sides = 0;
    int error = lens_sides(call, &sides);
    INVARIANT(error != 0 || sides != 0);
    if (error == 0 && call->values[0].given) {
        for (unsigned side = 0; error == 0 && side < RIG_SIDES; side++) {
            error = (sides >> side & 1) != 0 ? check_position(call, side, axis) : 0;
        }
        if (error == 0) {
            error = rig_lens_move_to(call->rig, sides, axis, (int32_t)call->values[0].integer);
        }
    }
    for (unsigned side = 0; error == 0 && side < RIG_SIDES; side++) {
        error = (sides >> side & 1) != 0 ? show_axis(call, side, axis) : 0;
    }
    return error;
}

int commands_aim_zoom(const struct command_call *call) {
    return run_axis(call, LENS_ZOOM);
}

int commands_aim_focus(const struct command_call *call) {
    return run_axis(call, LENS_FOCUS);
}

int commands_aim_iris(const struct command_call *call) {
    return run_axis(call, LENS_IRIS);
}

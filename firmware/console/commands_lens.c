// SPDX-License-Identifier: Apache-2.0
// The command lens: what the positions of the lenses mean, and what was learned about them.
#include <math.h>

#include "console/commands.h"
#include "console/lens_table_text.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/rig_clock.h"
#include "rig/rig_optics.h"

enum { STATUS, LEARNED, FORGET };
enum { VALUE_ACTION, VALUE_SIDE, VALUE_FOCUS, VALUE_IRIS, VALUE_OBJECT };
enum { READINGS = 8 };

static const double q4 = 16, us_per_s = 1e6;

// ---- what a position means

void commands_lens_meaning(const struct command_call *call, unsigned side, enum lens_axis axis,
                           int32_t position) {
    const struct rig *rig = call->rig;
    double value = 0, wide_mm = 0;
    if (axis == LENS_ZOOM) {
        if (rig_optics_focal_length(rig, side, position, &value) == ERROR_OK &&
            rig_optics_wide(rig, side, &wide_mm) == ERROR_OK) {
            reply_number(call, "focal_length", value, 2, "mm");
            reply_number(call, "magnification", value / wide_mm, 2, "x");
        }
    } else if (axis == LENS_FOCUS) {
        if (rig_optics_distance_at(rig, side, position, &value) == ERROR_OK) {
            commands_lens_distance(call, "distance", value);
        }
    } else if (rig_optics_f_number(rig, side, position, &value) == ERROR_OK) {
        reply_number(call, "f_number", value, 2, "f/");
    }
}

void commands_lens_distance(const struct command_call *call, const char *key, double distance_mm) {
    if (isinf(distance_mm) || distance_mm > 1e6) {
        reply_text(call, key, "infinity");
    } else {
        reply_number(call, key, distance_mm, 1, "mm");
    }
}

// ---- status

static uint32_t count_points(const struct lens_learned *learned, enum lens_axis axis) {
    if (axis == LENS_FOCUS) {
        return learned->focus.count;
    }
    return axis == LENS_IRIS ? learned->iris.count : 0;
}

/// Where the meaning of an axis comes from.
static void put_knowledge(const struct command_call *call, unsigned side, enum lens_axis axis) {
    static const enum rig_optics_relation relations[LENS_AXES] = {
        RIG_OPTICS_FOCAL_LENGTH, RIG_OPTICS_DISTANCE, RIG_OPTICS_F_NUMBER};
    const uint32_t points = count_points(&call->rig->camera[side].lens.learned, axis);
    const bool stated = rig_optics_missing(call->rig, relations[axis]) == NULL;
    const char *other = stated ? "data sheet" : "no";
    reply_text(call, "known", points > 0 ? "learned" : other);
    if (points > 0) {
        reply_number(call, "points", points, 0, NULL);
    }
}

static void put_axis(const struct command_call *call, unsigned side, enum lens_axis axis,
                     const struct lens_mean *mean) {
    const struct lens_axis_settings *settings = &call->rig->profile.lens.axis[axis];
    reply_group_begin(call, lens_axis_names[axis], false);
    reply_number(call, "position", mean->position_q4 / q4, 2, "counts");
    reply_number(call, "sigma", mean->sigma_q4 / q4, 2, "counts");
    reply_number(call, "min", settings->min, 0, "counts");
    reply_number(call, "max", settings->max, 0, "counts");
    commands_lens_meaning(call, side, axis, lens_mean_counts(mean));
    put_knowledge(call, side, axis);
    reply_group_end(call);
}

/// Blur and depth of field, where they are known.
static void put_blur(const struct command_call *call, unsigned side,
                     const struct lens_mean *focus) {
    const struct rig *rig = call->rig;
    double distance_mm = 0;
    double per_count_px = 0, near_mm = 0, far_mm = 0, blur_px = 0, diffraction_px = 0;
    if (rig_optics_blur_per_count(rig, side, &per_count_px) != ERROR_OK ||
        rig_optics_distance_at(rig, side, lens_mean_counts(focus), &distance_mm) != ERROR_OK ||
        rig_optics_sharp_range(rig, side, distance_mm, RIG_OPTICS_SHARP_PX, &near_mm, &far_mm) !=
            0 ||
        rig_optics_blur_at(rig, side, near_mm, &blur_px, &diffraction_px) != ERROR_OK) {
        return;
    }
    reply_number(call, "blur_per_count", per_count_px, 3, "px");
    reply_number(call, "diffraction", diffraction_px, 2, "px");
    commands_lens_distance(call, "sharp_near", near_mm);
    commands_lens_distance(call, "sharp_far", far_mm);
}

static void put_last_focus(const struct command_call *call, unsigned side) {
    const struct rig_lens *lens = &call->rig->camera[side].lens;
    const uint64_t now_us = rig_now_us(call->rig);
    int32_t position = 0, half_range = 0;
    if (lens->focused_us != 0 && now_us >= lens->focused_us) {
        reply_group_begin(call, "autofocus", false);
        reply_number(call, "position", lens->focused_q4 / q4, 2, "counts");
        reply_number(call, "last", (double)(now_us - lens->focused_us) / us_per_s, 1, "s ago");
        reply_group_end(call);
    }
    if (rig_optics_focus_prediction(call->rig, side, &position, &half_range) == ERROR_OK) {
        reply_group_begin(call, "prediction", false);
        reply_number(call, "position", position, 0, "counts");
        reply_number(call, "half_range", half_range, 0, "counts");
        reply_group_end(call);
    }
}

static int put_status(const struct command_call *call, unsigned side) {
    struct lens_mean means[LENS_AXES];
    const int error = rig_lens_read_mean(call->rig, side, READINGS, means);
    if (error != ERROR_OK) {
        return error;
    }
    reply_group_begin(call, commands_side_name(side), false);
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        if (rig_has_axis(&call->rig->profile, side, (enum lens_axis)axis)) {
            put_axis(call, side, (enum lens_axis)axis, &means[axis]);
        }
    }
    put_blur(call, side, &means[LENS_FOCUS]);
    put_last_focus(call, side);
    reply_group_end(call);
    return ERROR_OK;
}

// ---- what was learned

static void put_learned(const struct command_call *call, unsigned side) {
    char bytes[LENS_TABLE_TEXT_BYTES];
    const struct lens_learned *learned = &call->rig->camera[side].lens.learned;
    reply_group_begin(call, commands_side_name(side), false);
    struct command_text text = command_text_begin(bytes, sizeof bytes);
    lens_table_print(LENS_TABLE_FOCUS, &learned->focus, &text);
    reply_text(call, "focus", bytes);
    text = command_text_begin(bytes, sizeof bytes);
    lens_table_print(LENS_TABLE_IRIS, &learned->iris, &text);
    reply_text(call, "iris", bytes);
    reply_group_end(call);
}

static int refuse_table(const struct command_call *call, const char *option, const char *expected) {
    struct command_text sentence = commands_sentence(call);
    command_text_join(&sentence, "lens: invalid ", option, "= (expected ", expected, ", or none)");
    return ERROR_SYNTAX;
}

/// Takes the tables that are given.
static int take_tables(const struct command_call *call, struct lens_learned *learned,
                       struct lens_object *object) {
    const struct command_value *values = call->values;
    if (values[VALUE_FOCUS].given &&
        !lens_table_parse(LENS_TABLE_FOCUS, values[VALUE_FOCUS].text, &learned->focus)) {
        return refuse_table(call, "focus", "ZOOM:DEVIATION:SIGMA:TIMES,... ascending, at most 16");
    }
    if (values[VALUE_IRIS].given &&
        !lens_table_parse(LENS_TABLE_IRIS, values[VALUE_IRIS].text, &learned->iris)) {
        return refuse_table(call, "iris", "IRIS:RATIO:SIGMA:TIMES,... ascending, at most 16");
    }
    return !values[VALUE_OBJECT].given || lens_object_parse(values[VALUE_OBJECT].text, object)
               ? 0
               : refuse_table(call, "object", "FOCUS:SIGMA");
}

/// Replaces the tables that are given.
static int set_learned(const struct command_call *call, unsigned sides) {
    struct rig *rig = call->rig;
    struct lens_learned read[RIG_SIDES];
    struct lens_object object = rig->object;
    int error = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        read[side] = rig->camera[side].lens.learned;
        error = (sides >> side & 1) != 0 ? take_tables(call, &read[side], &object) : ERROR_OK;
    }
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        rig->camera[side].lens.learned = read[side];
    }
    rig->object = object;
    return error;
}

static void forget(const struct command_call *call, unsigned sides) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            call->rig->camera[side].lens.learned = (struct lens_learned){.focus = {.count = 0}};
        }
    }
    call->rig->object = (struct lens_object){.known = false};
}

static int show_status(const struct command_call *call, unsigned sides) {
    int error = call->rig->state == RIG_READY ? ERROR_OK : commands_not_ready(call, "lens status");
    for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        error = (sides >> side & 1) != 0 ? put_status(call, side) : ERROR_OK;
    }
    return error;
}

static void show_learned(const struct command_call *call, unsigned sides) {
    char bytes[LENS_TABLE_TEXT_BYTES];
    struct command_text text = command_text_begin(bytes, sizeof bytes);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            put_learned(call, side);
        }
    }
    lens_object_print(&call->rig->object, &text);
    reply_text(call, "object", bytes);
}

int commands_lens_run(const struct command_call *call) {
    const int action = call->values[VALUE_ACTION].choice;
    unsigned sides = 0;
    int error = commands_axis_sides(call, &call->values[VALUE_SIDE], &sides);
    INVARIANT(action >= STATUS && action <= FORGET);
    if (error != ERROR_OK || action == STATUS) {
        return error != ERROR_OK ? error : show_status(call, sides);
    }
    if (action == LEARNED) {
        error = set_learned(call, sides);
    } else {
        forget(call, sides);
    }
    if (error == ERROR_OK) {
        show_learned(call, sides);
    }
    return error;
}

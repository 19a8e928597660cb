// SPDX-License-Identifier: Apache-2.0
// Commands zoom and iris, and `focus` of a lens.
#include <math.h>

#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "rig/auto/iris_learn.h"
#include "rig/lens_move.h"
#include "rig/rig_optics.h"

enum { VALUE_POSITION, VALUE_SIDE, VALUE_RIGHT, VALUE_SHARP };

/// Index of "x" in COMMANDS_ZOOM_UNITS.
enum { UNIT_COUNTS, UNIT_X };

int commands_axis_sides(const struct command_call *call, const struct command_value *side_value,
                        unsigned *sides) {
    const struct rig_profile *profile = &call->rig->profile;
    *sides = commands_sides(side_value);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((*sides >> side & 1) != 0 && !rig_has_lens(profile, side)) {
            if (!side_value->given && rig_has_lens(profile, RIG_LEFT)) {
                *sides &= ~(1U << side);
                continue;
            }
            struct command_text sentence = commands_sentence(call);
            command_text_join(&sentence, "no motorized lens on the ", commands_side_name(side));
            return ERROR_NOT_CONNECTED;
        }
    }
    return ERROR_OK;
}

// ---- the position that was typed

const struct command_value *commands_axis_typed(const struct command_call *call, unsigned side) {
    const struct command_value *right = &call->values[VALUE_RIGHT];
    return side == RIG_RIGHT && right->given ? right : &call->values[VALUE_POSITION];
}

int commands_axis_check_right(const struct command_call *call, unsigned sides) {
    const struct command_value *values = call->values;
    if (!values[VALUE_RIGHT].given || (values[VALUE_POSITION].given && sides == 3)) {
        return ERROR_OK;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_add(&sentence, "right= requires POSITION, two lenses and no side");
    return ERROR_ARGUMENT;
}

/// Writes `zoom: POSITION 12x is out of range (expected for the left lens: ` and returns the text.
static struct command_text begin_out_of_range(const struct command_call *call, unsigned side,
                                              enum lens_axis axis) {
    struct command_text sentence = commands_sentence(call);
    const struct command_value *typed = commands_axis_typed(call, side);
    command_text_join(&sentence, lens_axis_names[axis],
                      typed == &call->values[VALUE_RIGHT] ? ": right=" : ": POSITION ");
    command_text_add_typed(&sentence, typed->text);
    command_text_join(&sentence, " is out of range (expected for the ", commands_side_name(side),
                      " lens: ");
    return sentence;
}

static int check_counts(const struct command_call *call, unsigned side, enum lens_axis axis,
                        int32_t *position) {
    struct lens_limits limits;
    const int error = rig_lens_limits(call->rig, side, axis, &limits);
    if (error != ERROR_OK) {
        return error;
    }
    const int64_t typed = commands_axis_typed(call, side)->integer;
    if (typed >= limits.min && typed <= limits.max) {
        *position = (int32_t)typed;
        return ERROR_OK;
    }
    struct command_text sentence = begin_out_of_range(call, side, axis);
    command_text_add_integer(&sentence, limits.min);
    command_text_add(&sentence, " to ");
    command_text_add_integer(&sentence, limits.max);
    command_text_add(&sentence, " counts)");
    return ERROR_RANGE;
}

/// Adds the range of a lens in the unit that was typed.
static void add_range(const struct command_call *call, unsigned side, enum lens_axis axis,
                      struct command_text *sentence) {
    const struct lens_axis_settings *settings = &call->rig->profile.lens.axis[axis];
    double low = 0, high = 0, scale = 1;
    int error = ERROR_OK;
    if (axis == LENS_ZOOM) {
        error = rig_optics_focal_length(call->rig, side, settings->min, &low);
        error = error == ERROR_OK ? rig_optics_focal_length(call->rig, side, settings->max, &high)
                                  : error;
        scale = commands_axis_typed(call, side)->unit == UNIT_X ? low : 1;
        command_text_add_number(sentence, low / scale, 2);
        command_text_add(sentence, " to ");
        command_text_add_number(sentence, high / scale, 2);
        command_text_add(sentence, commands_axis_typed(call, side)->unit == UNIT_X ? "x)" : " mm)");
    } else if (axis == LENS_FOCUS) {
        error = rig_optics_distance_at(call->rig, side, settings->max, &low);
        command_text_add(sentence, "at least ");
        command_text_add_number(sentence, low, 0);
        command_text_add(sentence, " mm)");
    } else {
        error = rig_optics_f_number(call->rig, side, settings->max, &low);
        error =
            error == ERROR_OK ? rig_optics_f_number(call->rig, side, settings->min, &high) : error;
        command_text_add(sentence, "f/");
        command_text_add_number(sentence, low, 1);
        command_text_add(sentence, " to f/");
        command_text_add_number(sentence, high, 1);
        command_text_add(sentence, ")");
    }
    INVARIANT(error == ERROR_OK);
}

/// Explains why a relation gave no position.
static int refuse_relation(const struct command_call *call, unsigned side, enum lens_axis axis,
                           int error) {
    static const enum rig_optics_relation relations[LENS_AXES] = {
        RIG_OPTICS_FOCAL_LENGTH, RIG_OPTICS_DISTANCE, RIG_OPTICS_F_NUMBER};
    static const char *const names[LENS_AXES] = {"the focal lengths", "the focus distances",
                                                 "the f-numbers"};
    if (error == ERROR_MISSING) {
        struct command_text sentence = commands_sentence(call);
        command_text_join(&sentence, lens_axis_names[axis], ": ", names[axis],
                          " of this lens are not known (set ",
                          rig_optics_missing(call->rig, relations[axis]), ", or use counts)");
    } else if (error == ERROR_RANGE) {
        struct command_text sentence = begin_out_of_range(call, side, axis);
        add_range(call, side, axis, &sentence);
    }
    return error;
}

/// The position that POSITION means for a lens.
static int target_of(const struct command_call *call, unsigned side, enum lens_axis axis,
                     int32_t *position) {
    const struct command_value *value = commands_axis_typed(call, side);
    const struct rig *rig = call->rig;
    double number = value->number;
    int error = ERROR_OK;
    if (value->choice < 0 && value->unit == UNIT_COUNTS) {
        return check_counts(call, side, axis, position);
    }
    if (axis == LENS_ZOOM) {
        double wide_mm = 1;
        error = value->unit == UNIT_X ? rig_optics_wide(rig, side, &wide_mm) : ERROR_OK;
        error =
            error == ERROR_OK ? rig_optics_zoom_for(rig, side, number * wide_mm, position) : error;
    } else if (axis == LENS_FOCUS) {
        number = value->choice >= 0 ? (double)INFINITY : number;
        error = rig_optics_focus_for(rig, side, number, position);
    } else {
        error = rig_optics_iris_for(rig, side, number, position);
    }
    return error == ERROR_OK ? ERROR_OK : refuse_relation(call, side, axis, error);
}

// ---- showing

/// Adds a note where a lens was sent to a target that it cannot approach from its side.
static void put_play(const struct command_call *call, enum lens_axis axis, int32_t target) {
    const struct lens_axis_settings *settings = &call->rig->profile.lens.axis[axis];
    if (target == INT32_MIN || lens_move_has_room(settings, target)) {
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

/// `target`: where it was sent, INT32_MIN: nowhere.
static int put_axis(const struct command_call *call, unsigned side, enum lens_axis axis,
                    int32_t target) {
    struct lens_mean means[LENS_AXES];
    struct lens_limits limits;
    int error = rig_lens_read_mean(call->rig, side, RIG_LENS_READINGS, means);
    if (error == ERROR_OK) {
        error = rig_lens_limits(call->rig, side, axis, &limits);
    }
    if (error == ERROR_OK) {
        reply_number(call, "position", means[axis].position_q4 / 16.0, 2, "counts");
        reply_number(call, "min", limits.min, 0, "counts");
        reply_number(call, "max", limits.max, 0, "counts");
        commands_lens_meaning(call, side, axis, lens_mean_counts(&means[axis]));
        put_play(call, axis, target);
    }
    return error;
}

// ---- moving

int commands_axis_run(const struct command_call *call, enum lens_axis axis) {
    int32_t targets[RIG_SIDES] = {INT32_MIN, INT32_MIN};
    unsigned sides = 0;
    int error = commands_axis_sides(call, &call->values[VALUE_SIDE], &sides);
    INVARIANT(error != ERROR_OK || sides != 0);
    error = error == ERROR_OK ? commands_axis_check_right(call, sides) : error;
    if (error == ERROR_OK && call->values[VALUE_POSITION].given) {
        for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
            error =
                (sides >> side & 1) != 0 ? target_of(call, side, axis, &targets[side]) : ERROR_OK;
        }
        error = error == ERROR_OK ? rig_lens_move_each(call->rig, sides, axis, targets) : error;
    }
    for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            reply_group_begin(call, commands_side_name(side), false);
            error = put_axis(call, side, axis, targets[side]);
            reply_group_end(call);
        }
    }
    return error;
}

int commands_axis_zoom(const struct command_call *call) {
    for (int i = COMMANDS_ZOOM_DENSITY; i < COMMANDS_ZOOM_ARGUMENTS; i++) {
        if (call->values[i].given) {
            struct command_text sentence = commands_sentence(call);
            command_text_add(
                &sentence,
                "zoom: only POSITION, side and right work here: the others need the saved "
                "calibration of all zooms, which this program does not have");
            return ERROR_MISSING;
        }
    }
    return commands_axis_run(call, LENS_ZOOM);
}

// ---- the iris for a depth of field

static int find_iris(const struct command_call *call, unsigned side,
                     struct rig_optics_iris *found) {
    const double *range_mm = call->values[VALUE_SHARP].numbers;
    const int error = rig_optics_iris_for_range(call->rig, side, range_mm[0], range_mm[1], found);
    if (error == ERROR_OK) {
        return ERROR_OK;
    }
    struct command_text sentence = commands_sentence(call);
    if (error == ERROR_MISSING) {
        command_text_join(&sentence, "iris: sharp= needs the settings ",
                          rig_optics_missing(call->rig, RIG_OPTICS_BLUR));
    } else if (error == ERROR_NOT_CONNECTED) {
        command_text_add(&sentence, "iris: sharp= needs motors for zoom, focus and iris");
    } else if (error == ERROR_RANGE) {
        command_text_add(&sentence, "iris: sharp=");
        command_text_add_typed(&sentence, call->values[VALUE_SHARP].text);
        command_text_add(
            &sentence,
            " is not a range in front of the lens (expected NEAR:FAR in mm, the nearer "
            "first, with a middle that the focus reaches)");
    }
    return error;
}

/// Exposes `factor` times as long, up to what a pair allows.
static int follow_exposure(const struct command_call *call, unsigned side, double factor) {
    struct rig *rig = call->rig;
    const struct rig_camera *camera = &rig->camera[side];
    const uint32_t before_us =
        camera->exposure_us != 0 ? camera->exposure_us : camera->initial_exposure_us;
    if (before_us == 0) {
        reply_text(call, "exposure_note", "not set here, so it stays as the camera has it");
        return ERROR_OK;
    }
    const double max_us = math_min(RIG_EXPOSURE_MAX_US, rig->profile.skew_limit_us);
    const double wanted_us = math_max(before_us * factor, 1);
    uint32_t applied_us = 0;
    const int error =
        rig_exposure(rig, 1U << side, (uint32_t)(math_min(wanted_us, max_us) + 0.5), &applied_us);
    if (error == ERROR_OK) {
        reply_number(call, "exposure", applied_us, 0, "us");
        if (wanted_us > max_us) {
            reply_number(call, "darker", wanted_us / applied_us, 2, "x");
            reply_text(
                call, "exposure_note",
                "at its limit (rig.skew_limit): the frames are darker; raise the gain or add "
                "light");
        }
    }
    return error;
}

const char *commands_iris_text(enum depth_iris_limit limit) {
    static const char *const texts[] = {
        [DEPTH_IRIS_NEEDED] = "the range is sharp",
        [DEPTH_IRIS_STEADY] = "the range is sharp; wider open, lamps would flicker",
        [DEPTH_IRIS_OPEN] = "the range is sharp with the iris open",
        [DEPTH_IRIS_DIFFRACTION] =
            "not all can be sharp: closed further, diffraction would blur it more",
        [DEPTH_IRIS_CLOSED] = "not all can be sharp: the iris closes no further",
        [DEPTH_IRIS_DARK] = "not all can be sharp: closed further, it would be too dark",
    };
    INVARIANT((unsigned)limit <= DEPTH_IRIS_DARK);
    return texts[limit];
}

static void put_found(const struct command_call *call, const struct rig_optics_iris *found) {
    reply_number(call, "blur", found->blur_px, 2, "px");
    reply_number(call, "diffraction", found->diffraction_px, 2, "px");
    reply_text(call, "result", commands_iris_text(found->limit));
    commands_lens_distance(call, "best_focus", found->focus_mm);
    reply_number(call, "best_focus_position", found->focus, 0, "counts");
    reply_number(call, "best_blur", found->best_px, 2, "px");
}

/// Finds the iris of a lens, and its f-number before.
static int prepare_sharp(const struct command_call *call, unsigned side,
                         struct rig_optics_iris *found, double *before) {
    int32_t positions[LENS_AXES];
    int error = rig_lens_read(call->rig, side, positions);
    error = error == ERROR_OK ? find_iris(call, side, found) : error;
    return error == ERROR_OK ? rig_optics_f_number(call->rig, side, positions[LENS_IRIS], before)
                             : error;
}

static int run_sharp(const struct command_call *call, unsigned sides) {
    struct rig_optics_iris found[RIG_SIDES];
    int32_t targets[RIG_SIDES] = {INT32_MIN, INT32_MIN};
    double before[RIG_SIDES];
    int error = ERROR_OK;
    for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            error = prepare_sharp(call, side, &found[side], &before[side]);
            targets[side] = error == ERROR_OK ? found[side].iris : INT32_MIN;
        }
    }
    error = error == ERROR_OK ? rig_lens_move_each(call->rig, sides, LENS_IRIS, targets) : error;
    for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) == 0) {
            continue;
        }
        const double ratio = found[side].f_number / before[side];
        reply_group_begin(call, commands_side_name(side), false);
        error = put_axis(call, side, LENS_IRIS, targets[side]);
        if (error == ERROR_OK) {
            put_found(call, &found[side]);
            error = follow_exposure(call, side, ratio * ratio);
        }
        reply_group_end(call);
    }
    return error;
}

/// Learns the irises, and shows their f-numbers.
static int run_learn(const struct command_call *call) {
    unsigned sides = 0;
    int error = commands_axis_sides(call, &call->values[VALUE_SIDE], &sides);
    for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) == 0) {
            continue;
        }
        error = rig_iris_learn(call->rig, side);
        if (error == ERROR_OK) {
            const struct lens_table *table = &call->rig->camera[side].lens.learned.iris;
            INVARIANT(table->count > 0);
            reply_group_begin(call, commands_side_name(side), false);
            reply_number(call, "points", table->count, 0, NULL);
            reply_number(call, "closed", table->point[0].value / (double)LENS_RATIO_ONE, 2,
                         "x f-number open");
            error = put_axis(call, side, LENS_IRIS, INT32_MIN);
            reply_group_end(call);
        }
    }
    return error;
}

int commands_axis_iris(const struct command_call *call) {
    const struct command_value *position = &call->values[VALUE_POSITION];
    const bool learn = position->given && position->choice >= 0;
    const bool sharp = call->values[VALUE_SHARP].given;
    if (!learn && !sharp) {
        return commands_axis_run(call, LENS_IRIS);
    }
    if (call->values[VALUE_RIGHT].given) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "iris: right= requires a position");
        return ERROR_ARGUMENT;
    }
    if (!sharp) {
        return run_learn(call);
    }
    if (position->given) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "iris: either POSITION or sharp=, not both");
        return ERROR_ARGUMENT;
    }
    unsigned sides = 0;
    const int error = commands_axis_sides(call, &call->values[VALUE_SIDE], &sides);
    return error == ERROR_OK ? run_sharp(call, sides) : error;
}

// SPDX-License-Identifier: Apache-2.0
// Commands focus, of a camera with a focus control of its own or a lens, and autofocus.
#include <math.h>

#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "rig/auto/autofocus.h"
#include "rig/auto/focus_mover.h"
#include "rig/rig.h"
#include "rig/rig_optics.h"

enum {
    AUTOFOCUS_SIDE,
    AUTOFOCUS_REGION,
    AUTOFOCUS_MEASURE,
    AUTOFOCUS_PREFER,
    AUTOFOCUS_WHOLE,
    AUTOFOCUS_CURVE
};
enum { FOCUS_POSITION, FOCUS_SIDE };  // arguments of the command `focus`
enum { ADVICE_BYTES = 256 };

// Farther away, a count of the ring or of its data sheet is much of the distance.
static const double far_mm_min = 5000;
// Lenses whose peaks differ by more than this, less than once in a thousand by their data sheets
// alone, are focused on two things; and by this blur, as it would not matter else.
static const double other_counts = 3 * 1.41 * LENS_PRIOR_Q4 / 16, other_px = 2;

// What a verdict means for a script.
static int error_of(enum focus_verdict verdict) {
    switch (verdict) {
        case FOCUS_FOCUSED:
        case FOCUS_SHARP_EVERYWHERE:
        case FOCUS_TWO_PEAKS:
            return ERROR_OK;
        case FOCUS_SCENE_CHANGED:
            return ERROR_MOVED;
        case FOCUS_LENS_JAMMED:
            return ERROR_JAMMED;
        case FOCUS_PENDING:
        case FOCUS_NO_CONTRAST:
        case FOCUS_PEAK_AT_END:
        case FOCUS_LIGHTS:
        case FOCUS_VERDICTS:
            break;
    }
    return ERROR_NO_FOCUS;
}

// "iris 480: +-11 mm": the iris that makes twice as much sharp, if there is one.
static void add_iris_advice(const struct command_call *call, unsigned side, double distance_mm,
                            double near_mm, double far_mm, struct command_text *advice) {
    const double reach_mm = 2 * math_min(distance_mm - near_mm, far_mm - distance_mm);
    int32_t iris = 0;
    double diffraction_px = 0;
    if (isinf(far_mm) || rig_optics_iris_for_reach(call->rig, side, distance_mm, reach_mm, &iris,
                                                   &diffraction_px) != ERROR_OK) {
        return;
    }
    command_text_add(advice, advice->length > 0 ? "; iris " : "iris ");
    command_text_add_integer(advice, iris);
    command_text_add(advice, ": +-");
    command_text_add_number(advice, reach_mm, reach_mm < 10 ? 1 : 0);
    command_text_add(advice, " mm");
    if (diffraction_px > RIG_OPTICS_SHARP_PX) {
        command_text_add(advice, ", but diffraction blurs everything by ");
        command_text_add_number(advice, diffraction_px, 1);
        command_text_add(advice, " px");
    }
}

// Between which a distance lies of which the ring's position is only a rough measure.
static void put_distance_bounds(const struct command_call *call, unsigned side,
                                double distance_mm) {
    const struct focus_result *result = &call->rig->camera[side].focus.search.result;
    double near_mm = 0, far_mm = 0;
    if (distance_mm > far_mm_min &&
        rig_optics_distance_bounds(call->rig, side, result->position, result->blur_counts, &near_mm,
                                   &far_mm) == ERROR_OK) {
        commands_lens_distance(call, "distance_from", near_mm);
        commands_lens_distance(call, "distance_to", far_mm);
    }
}

// The distances between which the image is sharp, where they are known, and what makes it more.
static void put_sharp_range(const struct command_call *call, unsigned side,
                            struct command_text *advice) {
    double distance_mm = 0, near_mm = 0, far_mm = 0;
    const int32_t focus = lens_mean_counts(&call->rig->camera[side].lens.measured[LENS_FOCUS]);
    if (rig_optics_distance_at(call->rig, side, focus, &distance_mm) != ERROR_OK ||
        rig_optics_sharp_range(call->rig, side, distance_mm, RIG_OPTICS_SHARP_PX, &near_mm,
                               &far_mm) != ERROR_OK) {
        return;
    }
    commands_lens_distance(call, "distance", distance_mm);
    put_distance_bounds(call, side, distance_mm);
    commands_lens_distance(call, "sharp_near", near_mm);
    commands_lens_distance(call, "sharp_far", far_mm);
    add_iris_advice(call, side, distance_mm, near_mm, far_mm, advice);
}

static void put_note(const struct command_call *call, const struct focus_search *search) {
    const struct focus_result *result = &search->result;
    if (search->options.choice != FOCUS_STRONGER && result->verdict == FOCUS_FOCUSED &&
        !search->options.curve_only) {
        reply_text(call, "note",
                   "the region shows one distance only, so that prefer=near and prefer=far do not "
                   "matter: for another, choose a region that shows more of it");
    } else if (result->light_changed) {
        reply_text(call, "note", "the light changed during the search");
    }
}

static void put_focus(const struct command_call *call, unsigned side) {
    const struct rig_focus *focus = &call->rig->camera[side].focus;
    const struct focus_result *result = &focus->search.result;
    char bytes[ADVICE_BYTES];
    struct command_text advice = command_text_begin(bytes, sizeof bytes);
    command_text_add(&advice, focus_search_help(&focus->search));
    reply_group_begin(call, commands_side_name(side), false);
    reply_text(call, "verdict", focus_search_text(&focus->search));
    const char *unit = focus_mover_steps(call->rig, side) > 0 ? "steps" : "counts";
    reply_number(call, "position", result->position, 1, unit);
    if (result->peak.height > 0 && result->verdict != FOCUS_NO_CONTRAST) {
        reply_number(call, "peak", result->peak.position, 1, unit);
    }
    if (result->second.height > 0) {
        reply_number(call, "other_peak", result->second.position, 1, unit);
    }
    if (result->blur_px >= 0 && result->verdict != FOCUS_NO_CONTRAST) {
        reply_number(call, "blur", result->blur_px, 1, "px");
    }
    if (error_of(result->verdict) == ERROR_OK) {
        put_sharp_range(call, side, &advice);
    }
    if (advice.length > 0) {
        reply_text(call, "advice", bytes);
    }
    put_note(call, &focus->search);
    reply_number(call, "frames", focus->frames, 0, NULL);
    reply_number(call, "tries", result->tries, 0, NULL);
    reply_number(call, "time", focus->duration_ms / 1000.0, 1, "s");
    reply_group_end(call);
}

// Names two distances where each lens is focused on its own.
static void put_disagreement(const struct command_call *call) {
    double distance_mm[RIG_SIDES], blur_px = 0;
    int32_t focus = 0;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const struct focus_result *result = &call->rig->camera[side].focus.search.result;
        const int32_t counts = (int32_t)math_round(result->position);
        if (error_of(result->verdict) != ERROR_OK ||
            rig_optics_distance_at(call->rig, side, counts, &distance_mm[side]) != ERROR_OK) {
            return;
        }
    }
    // Where the right lens would be for what the left one sees.
    if (rig_optics_focus_for(call->rig, RIG_RIGHT, distance_mm[RIG_LEFT], &focus) != ERROR_OK ||
        rig_optics_blur_per_count(call->rig, RIG_RIGHT, &blur_px) != ERROR_OK) {
        return;
    }
    const double off = fabs(focus - call->rig->camera[RIG_RIGHT].focus.search.result.position);
    if (off <= other_counts || off * blur_px <= other_px) {
        return;
    }
    char bytes[ADVICE_BYTES];
    struct command_text text = command_text_begin(bytes, sizeof bytes);
    command_text_add(&text, "the lenses are focused on different distances (left ");
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if (isinf(distance_mm[side])) {
            command_text_add(&text, "infinity");
        } else {
            command_text_add_number(&text, distance_mm[side] / 1000, 1);
            command_text_add(&text, " m");
        }
        command_text_add(&text, side == RIG_LEFT ? ", right "
                                                 : "): choose a region that shows the "
                                                   "subject in both cameras, or "
                                                   "prefer=near or prefer=far");
    }
    reply_text(call, "note", bytes);
}

static int sum_up(const struct command_call *call, unsigned sides) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const enum focus_verdict verdict = call->rig->camera[side].focus.search.result.verdict;
        const int error = (sides >> side & 1) != 0 ? error_of(verdict) : ERROR_OK;
        if (error != ERROR_OK) {
            struct command_text sentence = commands_sentence(call);
            command_text_join(&sentence, commands_side_name(side),
                              " camera: ", focus_verdict_text(verdict));
            command_text_join(&sentence, " (",
                              focus_search_help(&call->rig->camera[side].focus.search), ")");
            return error;
        }
    }
    return ERROR_OK;
}

int commands_focus_auto(const struct command_call *call) {
    static const enum focus_measure measures[] = {FOCUS_VARIANCE, FOCUS_NORMALIZED_VARIANCE,
                                                  FOCUS_TENENGRAD, FOCUS_LAPLACIAN};
    static const enum focus_choice choices[] = {FOCUS_STRONGER, FOCUS_NEARER, FOCUS_FARTHER};
    const struct command_value *values = call->values;
    const unsigned sides = commands_sides(&values[AUTOFOCUS_SIDE]);
    struct rig_autofocus_options options = {
        .whole_range = command_is_set(&values[AUTOFOCUS_WHOLE]),
        .curve_only = command_is_set(&values[AUTOFOCUS_CURVE]),
    };
    if (values[AUTOFOCUS_MEASURE].given) {
        options.measure = measures[values[AUTOFOCUS_MEASURE].choice];
    }
    if (values[AUTOFOCUS_PREFER].given) {
        options.choice = choices[values[AUTOFOCUS_PREFER].choice];
    }
    int error = commands_region(call, &values[AUTOFOCUS_REGION], RIG_AUTOFOCUS_REGION_MIN_PX,
                                FOCUS_WINDOW_MAX_PX, &options.region_px);
    if (error == ERROR_OK) {
        error = rig_autofocus(call->rig, sides, &options);
    }
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        if ((sides >> side & 1) != 0) {
            put_focus(call, side);
        }
    }
    if (error == ERROR_OK && sides == (1u << RIG_LEFT | 1u << RIG_RIGHT) && !options.curve_only) {
        put_disagreement(call);
    }
    // A curve has been measured whatever it shows.
    return error != ERROR_OK || options.curve_only ? error : sum_up(call, sides);
}

// ---- cameras with a focus control of their own

// The sides of these whose camera has a focus control of its own.
static unsigned controls_of(const struct command_call *call, unsigned sides) {
    unsigned controls = 0;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0 && focus_mover_steps(call->rig, side) > 0) {
            controls |= 1U << side;
        }
    }
    return controls;
}

// The step that POSITION means.
static int step_of(const struct command_call *call, unsigned side, double *step) {
    enum { UNIT_COUNTS = 0 };
    const struct command_value *value = commands_axis_typed(call, side);
    const unsigned steps = focus_mover_steps(call->rig, side);
    const bool is_known = value->choice >= 0 || value->unit == UNIT_COUNTS;
    *step = value->choice >= 0 ? 0 : (double)value->integer;  // the farthest one for infinity
    if (is_known && *step >= 0 && *step <= steps) {
        return ERROR_OK;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_add(&sentence, "focus: POSITION ");
    command_text_add_typed(&sentence, value->text);
    if (!is_known) {
        command_text_join(&sentence, " is not supported: the distances of the ",
                          commands_side_name(side), " camera are not known (use steps)");
        return ERROR_MISSING;
    }
    command_text_join(&sentence, " is out of range (expected for the ", commands_side_name(side),
                      " camera: 0 to ");
    command_text_add_integer(&sentence, steps);
    command_text_add(&sentence, " steps)");
    return ERROR_RANGE;
}

static int run_control(const struct command_call *call, unsigned sides) {
    const bool moves = call->values[FOCUS_POSITION].given;
    double target[RIG_SIDES] = {0, 0};
    int error = commands_axis_check_right(call, sides);
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK && moves; side++) {
        error = (sides >> side & 1) != 0 ? step_of(call, side, &target[side]) : ERROR_OK;
    }
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        if ((sides >> side & 1) == 0) {
            continue;
        }
        error = moves ? focus_mover_go(call->rig, side, target[side]) : ERROR_OK;
        if (error == ERROR_OK) {
            reply_group_begin(call, commands_side_name(side), false);
            reply_number(call, "position", focus_mover_position(call->rig, side), 0, "steps");
            reply_number(call, "min", 0, 0, "steps");
            reply_number(call, "max", focus_mover_steps(call->rig, side), 0, "steps");
            reply_group_end(call);
        }
    }
    return error;
}

int commands_focus_run(const struct command_call *call) {
    const unsigned sides = commands_sides(&call->values[FOCUS_SIDE]);
    const unsigned controls = controls_of(call, sides);
    // If no side was named, those that have a lens are meant first, as by the other commands.
    const bool all =
        !call->values[FOCUS_SIDE].given && !rig_has_lens(&call->rig->profile, RIG_LEFT);
    if (controls != 0 && (controls == sides || all)) {
        return run_control(call, controls);
    }
    return commands_axis_run(call, LENS_FOCUS);
}

// SPDX-License-Identifier: Apache-2.0
// Commands exposure, gain and autoexpose.
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/auto/autoexposure.h"
#include "rig/rig.h"

enum { SIDE, REGION, TARGET, WHITES, IRIS };

static const double parts_of_percent = 100;
static const double default_target = 0.5;

// What is said besides the figures: cameras that differ by more than this part, or by this factor
// before they are made equal; a middle that is so much darker; light that changes by this part; and
// what highlights leave of the target.
static const double equal_part = 0.02, other_factor = 1.5, backlit_factor = 2.5;
static const double flicker_part = 0.02, highlights_part = 0.25;
enum { NOTE_BYTES = 640, IRIS_NEAR_COUNTS = 10 };

// What keeps a picture from being brighter, or the target from being reached.
static const char *limit_of(const struct command_call *call,
                            const struct rig_autoexposure_side *side) {
    if (side->verdict == EXPOSURE_TOO_DARK) {
        const int32_t open = call->rig->profile.lens.axis[LENS_IRIS].max - IRIS_NEAR_COUNTS;
        if (side->iris != INT32_MIN && side->iris < open) {
            return "too dark at the longest exposure and the largest gain: open the iris, or let "
                   "it be opened (iris=yes)";
        }
        return side->iris == INT32_MIN
                   ? "too dark at the longest exposure and the largest gain: add light"
                   : "too dark at the longest exposure, the largest gain and open iris: add light";
    }
    if (side->verdict == EXPOSURE_TOO_BRIGHT) {
        return "too bright at the shortest exposure: use less light, or close the iris";
    }
    static const char *const bounds[] = {[EXPOSURE_BY_MEAN] = "target",
                                         [EXPOSURE_BY_HIGHLIGHTS] = "highlights",
                                         [EXPOSURE_BY_WHITES] = "whites"};
    return bounds[side->bound];
}

static void put_side(const struct command_call *call, unsigned at,
                     const struct rig_autoexposure_side *side) {
    reply_group_begin(call, commands_side_name(at), false);
    reply_number(call, "exposure", side->exposure_us, 0, "us");
    reply_number(call, "gain", side->gain_q3 / 8.0, 3, NULL);
    if (side->iris != INT32_MIN) {
        reply_number(call, "iris", side->iris, 0, "counts");
    }
    reply_number(call, "mean", parts_of_percent * side->mean, 1, "%");
    reply_number(call, "saturated", parts_of_percent * side->saturated, 2, "%");
    reply_number(call, "steps", side->steps, 0, NULL);
    reply_text(call, "limit", limit_of(call, side));
    reply_group_end(call);
}

static void add_note(struct command_text *note, const char *text) {
    command_text_add(note, note->length > 0 ? "; " : "");
    command_text_add(note, text);
}

static void add_backlight(struct command_text *note, const struct rig_autoexposure_request *request,
                          const struct rig_autoexposure_result *result) {
    bool backlit = false, highlights = false;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const struct rig_autoexposure_side *own = &result->side[side];
        if ((request->sides >> side & 1) != 0) {
            backlit = backlit || own->mean > backlit_factor * own->middle;
            highlights = highlights || (own->bound == EXPOSURE_BY_HIGHLIGHTS &&
                                        own->mean < highlights_part * request->target);
        }
    }
    if (backlit && request->region_px.width_px == 0) {
        add_note(note,
                 "the middle is much darker than the rest: for a subject before a bright "
                 "background choose its region=X,Y,W,H");
    } else if (highlights) {
        add_note(note,
                 "a few bright parts keep everything else dark: choose a region without "
                 "them, or merge several exposures");
    }
}

static void add_cameras(struct command_text *note, const struct rig_autoexposure_result *result) {
    const double ratio = result->ratio;
    if (ratio > other_factor || (ratio > 0 && ratio < 1 / other_factor)) {
        add_note(note, "at equal exposure the ");
        command_text_add(note, commands_side_name(ratio > 1 ? RIG_LEFT : RIG_RIGHT));
        command_text_add(note, " camera sees ");
        command_text_add_number(note, ratio > 1 ? ratio : 1 / ratio, 1);
        command_text_add(note,
                         " times as much light as the other: the region shows two different "
                         "things, or the irises differ");
    }
    if (result->difference > equal_part || result->difference < -equal_part) {
        add_note(note, result->difference > 0
                           ? "the right camera remains brighter than the left one: use less light, "
                             "or close its iris"
                           : "the right camera remains darker than the left one: use more light, "
                             "or open its iris");
    }
}

static void add_flicker(const struct command_call *call, struct command_text *note,
                        const struct rig_autoexposure_result *result) {
    const uint32_t half_us = rig_mains_half_us(&call->rig->profile);
    if (result->flicker > flicker_part && result->side[RIG_LEFT].exposure_us >= half_us) {
        add_note(note, "the light changes by ");
        command_text_add_number(note, parts_of_percent * result->flicker, 0);
        command_text_add(note, half_us != 0 ? " % from frame to frame, and not as lamps on the "
                                              "mains of rig.mains do: set that of the country, or "
                                              "use steady light"
                                            : " % from frame to frame: set rig.mains to the "
                                              "frequency of the mains, or use steady light");
    }
}

static void put_notes(const struct command_call *call,
                      const struct rig_autoexposure_request *request,
                      const struct rig_autoexposure_result *result) {
    char bytes[NOTE_BYTES];
    struct command_text note = command_text_begin(bytes, sizeof bytes);
    add_backlight(&note, request, result);
    if (request->sides == (1u << RIG_LEFT | 1u << RIG_RIGHT)) {
        add_cameras(&note, result);
        add_flicker(call, &note, result);
    }
    if (note.length > 0) {
        reply_text(call, "note", bytes);
    }
}

int commands_exposure_auto(const struct command_call *call) {
    struct rig_autoexposure_request request = {
        .sides = commands_sides(&call->values[SIDE]),
        .target = call->values[TARGET].given ? call->values[TARGET].number / parts_of_percent
                                             : default_target,
        .whites = command_is_set(&call->values[WHITES]),
        .keep_iris = call->values[IRIS].given && call->values[IRIS].choice == 0,
    };
    int error = commands_region(call, &call->values[REGION], RIG_AUTOEXPOSURE_REGION_MIN_PX,
                                UINT16_MAX, &request.region_px);
    if (error != ERROR_OK) {
        return error;
    }
    struct rig_autoexposure_result result;
    error = rig_autoexposure(call->rig, &request, &result);
    for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        if ((request.sides >> side & 1) != 0) {
            put_side(call, side, &result.side[side]);
        }
    }
    if (error == ERROR_OK && request.sides == (1u << RIG_LEFT | 1u << RIG_RIGHT)) {
        reply_number(call, "difference", parts_of_percent * result.difference, 1, "%");
    }
    if (error == ERROR_OK) {
        put_notes(call, &request, &result);
    }
    return error;
}

// ---- exposure and gain

// 0: never set here, so the camera decides.
static void show_setting(const struct command_call *call, unsigned side, double value, int decimals,
                         const char *unit) {
    if (value == 0) {
        reply_text(call, commands_side_name(side), "not set");
    } else {
        reply_number(call, commands_side_name(side), value, decimals, unit);
    }
}

int commands_exposure_run(const struct command_call *call) {
    const unsigned sides = commands_sides(&call->values[1]);
    uint32_t applied_us = 0;
    int error = ERROR_OK;
    if (call->values[0].given) {
        INVARIANT(call->values[0].integer > 0 && call->values[0].integer <= UINT32_MAX);
        error = rig_exposure(call->rig, sides, (uint32_t)call->values[0].integer, &applied_us);
    }
    for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            show_setting(call, side, call->rig->camera[side].exposure_us, 0, "us");
        }
    }
    return error;
}

int commands_exposure_gain(const struct command_call *call) {
    const unsigned sides = commands_sides(&call->values[1]);
    int error = ERROR_OK;
    if (call->values[0].given) {
        const double gain_q3 = call->values[0].number * 8 + 0.5;
        INVARIANT(gain_q3 > 0 && gain_q3 <= UINT16_MAX);
        uint16_t applied_q3 = 0;
        error = rig_gain(call->rig, sides, (uint16_t)gain_q3, &applied_q3);
    }
    for (unsigned side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        if ((sides >> side & 1) != 0) {
            show_setting(call, side, call->rig->camera[side].gain_q3 / 8.0, 3, NULL);
        }
    }
    return error;
}

// SPDX-License-Identifier: Apache-2.0
#include "console/pair/calibration_match.h"

#include <math.h>
#include <string.h>

#include "console/command_text.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "device/mt9t001.h"

static const double urad_per_rad = 1e6;
static const double share_per_ppm = 1e-6;
/// Tolerance for the decimals of the text: a value exactly at the limit passes.
static const double rounding = 2e-3;

static double limit_of(const struct pair_instrument *instrument, int axis) {
    return axis == CALIBRATION_PAN
               ? instrument->pan_repeatability_urad / urad_per_rad * MATH_DEGREE_PER_RAD
               : instrument->lens_repeatability_counts;
}

bool calibration_match_is_apart(const struct pair_instrument *instrument, int axis, double one,
                                double other) {
    return fabs(one - other) > limit_of(instrument, axis) + rounding;
}

// ---- what a pair was taken with

struct pair_instrument calibration_match_instrument(const struct rig_profile *profile) {
    struct pair_instrument instrument = {
        .pan_repeatability_urad = profile->pan_repeatability_urad,
        .lens_repeatability_counts = (uint32_t)profile->lens.repeatability_counts,
        .lens_zoom_ppm = (uint32_t)profile->lens.zoom_ppm,
    };
    for (int side = 0; side < RIG_SIDES && profile->servos; side++) {
        instrument.servo_centre_q4[side] = profile->servo[side].centre_q4;
        instrument.servo_q4_per_rad[side] = profile->servo[side].q4_per_rad;
    }
    return instrument;
}

/// Copies a name as one line of printable ASCII, as the calibration's text requires.
static void copy_name(char target[CALIBRATION_NAME_BYTES], const char *name) {
    struct command_text text = command_text_begin(target, CALIBRATION_NAME_BYTES);
    command_text_add(&text, name + strspn(name, " "));
    for (char *at = target; *at != '\0'; at++) {
        *at = *at < ' ' || *at > '~' ? '?' : *at;
    }
    for (size_t end = strlen(target); end > 0 && target[end - 1] == ' '; end--) {
        target[end - 1] = '\0';
    }
}

static struct calibration_axis between(double before, double after) {
    return (struct calibration_axis){CALIBRATION_AXIS_KNOWN, (before + after) / 2,
                                     fabs(after - before) / 2};
}

bool calibration_match_pan_deg(const struct pair_instrument *instrument, int side, double pulse_q4,
                               double *deg) {
    const double q4_per_degree = instrument->servo_q4_per_rad[side] / MATH_DEGREE_PER_RAD;
    if (!(q4_per_degree > 0)) {
        return false;
    }
    *deg = (pulse_q4 - instrument->servo_centre_q4[side]) / q4_per_degree;
    return true;
}

static struct calibration_axis pan_of(const struct pair_instrument *instrument, int side,
                                      const struct pair_frame *frame) {
    double before_deg, after_deg;
    if (!calibration_match_pan_deg(instrument, side, frame->before.pan_q4, &before_deg) ||
        !calibration_match_pan_deg(instrument, side, frame->after.pan_q4, &after_deg)) {
        return (struct calibration_axis){
            .kind = frame->before.pan_q4 == 0 ? CALIBRATION_AXIS_NONE : CALIBRATION_AXIS_UNKNOWN};
    }
    if (frame->before.pan_q4 == 0 || frame->after.pan_q4 == 0) {
        return (struct calibration_axis){.kind = CALIBRATION_AXIS_UNKNOWN};
    }
    return between(before_deg, after_deg);
}

void calibration_match_pair(const char *profile, const struct pair_instrument *instrument,
                            const struct pair *pair, struct calibration_match_state *state) {
    struct rig_profile built_in;
    memset(state, 0, sizeof *state);
    if (instrument != NULL) {
        state->instrument = *instrument;
    } else if (rig_profile_named(profile, &built_in) == ERROR_OK) {
        state->instrument = calibration_match_instrument(&built_in);
    }
    copy_name(state->origin.instrument, profile);
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct pair_frame *frame = &pair->frame[side];
        struct calibration_side_origin *origin = &state->origin.side[side];
        copy_name(origin->camera, state->instrument.camera[side]);
        origin->window = (struct calibration_window){frame->window.column_px, frame->window.row_px,
                                                     frame->window.skip};
        origin->axis[CALIBRATION_PAN] = pan_of(&state->instrument, side, frame);
        for (int axis = 0; axis < LENS_AXES; axis++) {
            const int32_t before = frame->before.lens[axis].position_q4;
            const int32_t after = frame->after.lens[axis].position_q4;
            origin->axis[CALIBRATION_ZOOM + axis] =
                before == INT32_MIN || after == INT32_MIN
                    ? (struct calibration_axis){.kind = CALIBRATION_AXIS_NONE}
                    : between(before / 16.0, after / 16.0);
        }
        state->width_px[side] = frame->image.width_px;
        state->height_px[side] = frame->image.height_px;
    }
}

void calibration_match_now(const struct rig *rig, const struct pair_instrument *instrument,
                           struct calibration_match_state *state) {
    struct pair pair;
    memset(&pair, 0, sizeof pair);
    for (int side = 0; side < RIG_SIDES; side++) {
        struct pair_frame *frame = &pair.frame[side];
        frame->before.pan_q4 = rig->camera[side].pan_q4;
        memcpy(frame->before.lens, rig->camera[side].lens.measured, sizeof frame->before.lens);
        frame->after = frame->before;
        frame->image.width_px = rig->format.width_px;
        frame->image.height_px = rig->format.height_px;
        if (rig->profile.bridge && rig->state == RIG_READY) {
            const struct mt9t001_window *window = &rig->camera[side].sensor.window;
            frame->window = (struct pair_window){window->column_px, window->row_px, window->skip};
        }
    }
    calibration_match_pair(rig->profile.name, instrument, &pair, state);
}

// ---- comparing

/// Appends the advice to `message`, unless the mismatch was accepted. Returns ERROR_MISMATCH.
static int advise(struct message *message, const char *advice, const char *accept) {
    const size_t used = strlen(message->text);
    if (accept != NULL) {
        struct command_text text =
            command_text_begin(message->text + used, sizeof message->text - used);
        command_text_join(&text, ": ", advice, ", or accept it with ", accept);
    }
    return ERROR_MISMATCH;
}

static bool differ(const char *a, const char *b) {
    return a[0] != '\0' && b[0] != '\0' && strcmp(a, b) != 0;
}

static int match_cameras(const struct calibration_origin *made,
                         const struct calibration_origin *now, const char *accept,
                         struct message *message) {
    if (differ(made->instrument, now->instrument)) {
        command_text_message(message, ERROR_MISMATCH,
                             "this instrument is \"%s\", the calibration was made with \"%s\"",
                             now->instrument, made->instrument);
        return advise(message, "calibrate this instrument", accept);
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        const char *camera = now->side[side].camera;
        if (!differ(made->side[side].camera, camera)) {
            continue;
        }
        const bool swapped = strcmp(camera, made->side[1 - side].camera) == 0;
        command_text_message(message, ERROR_MISMATCH,
                             "%sthe %s camera is \"%s\", the calibration was made with \"%s\"",
                             swapped ? "the cameras are swapped: " : "", rig_side_names[side],
                             camera, made->side[side].camera);
        return advise(message, swapped ? "swap left_camera and right_camera" : "calibrate again",
                      accept);
    }
    return ERROR_OK;
}

static bool is_whole_sensor(const struct lens *lens, const struct calibration_window *window) {
    return lens->width_px == MT9T001_WIDTH_PX && lens->height_px == MT9T001_HEIGHT_PX &&
           window->column_px == 0 && window->row_px == 0 && window->skip == 1;
}

/// Images of another size. Those of a window that is known may be cut from the whole sensor's.
static int match_size(const struct calibration *calibration, int side,
                      const struct calibration_match_state *state, struct message *message) {
    const struct lens *lens = side == RIG_LEFT ? &calibration->left : &calibration->right;
    const int width_px = state->width_px[side], height_px = state->height_px[side];
    const bool whole_sensor =
        lens->width_px == MT9T001_WIDTH_PX && lens->height_px == MT9T001_HEIGHT_PX;
    if (width_px == 0 || (lens->width_px == width_px && lens->height_px == height_px) ||
        (whole_sensor && state->origin.side[side].window.skip != 0)) {
        return ERROR_OK;
    }
    return command_text_message(message, ERROR_SIZE_MISMATCH,
                                "the %s images have %dx%d px, the calibration is for %dx%d px: set "
                                "\"window\" to that size, or calibrate again",
                                rig_side_names[side], width_px, height_px, lens->width_px,
                                lens->height_px);
}

static int match_window(const struct calibration *calibration, int side,
                        const struct calibration_match_state *state, const char *accept,
                        struct message *message) {
    const struct lens *lens = side == RIG_LEFT ? &calibration->left : &calibration->right;
    const struct calibration_window *made = &calibration->origin.side[side].window;
    const struct calibration_window *now = &state->origin.side[side].window;
    const int width_px = state->width_px[side], height_px = state->height_px[side];
    if (made->skip == 0 || now->skip == 0 || is_whole_sensor(lens, made) ||
        (lens->width_px == width_px && lens->height_px == height_px &&
         made->column_px == now->column_px && made->row_px == now->row_px &&
         made->skip == now->skip)) {
        return ERROR_OK;
    }
    command_text_message(
        message, ERROR_MISMATCH,
        "the %s window is %d x %d px at %d,%d with skip %d, the calibration was made for "
        "%d x %d px at %d,%d with skip %d",
        rig_side_names[side], width_px, height_px, now->column_px, now->row_px, now->skip,
        lens->width_px, lens->height_px, made->column_px, made->row_px, made->skip);
    return advise(message, "set \"window\", calibrate again", accept);
}

/// Whether a servo was not set since bring-up, so that its position is unknown.
static bool is_unset(const struct calibration_axis *here, int side, int axis,
                     const struct pair_instrument *instrument) {
    return axis == CALIBRATION_PAN && here->kind == CALIBRATION_AXIS_UNKNOWN &&
           instrument->servo_q4_per_rad[side] > 0;
}

static int match_axis(const struct calibration_axis *then, const struct calibration_axis *here,
                      int side, int axis, const struct pair_instrument *instrument,
                      const char *accept, struct message *message) {
    const double limit = limit_of(instrument, axis);
    const bool apart = calibration_match_is_apart(instrument, axis, then->mean, here->mean);
    const char *const side_name = rig_side_names[side];
    const char *const name = calibration_reply_axis_name(axis);
    const char *const unit = calibration_reply_axis_unit(axis);
    const int decimals = axis == CALIBRATION_PAN ? 3 : 1;
    const bool unset = is_unset(here, side, axis, instrument);
    char advice[96];
    if (then->kind != CALIBRATION_AXIS_KNOWN ||
        (!unset && (here->kind != CALIBRATION_AXIS_KNOWN || !apart))) {
        return ERROR_OK;
    }
    if (unset) {
        command_text_message(
            message, ERROR_MISMATCH,
            "%s %s is unknown (not set since bring-up), the calibration was made at %.*f %s",
            side_name, name, decimals, then->mean, unit);
    } else {
        command_text_message(
            message, ERROR_MISMATCH,
            "%s %s is at %.*f %s, the calibration was made at %.*f %s (%.*f %s apart, at "
            "most %.*f)",
            side_name, name, decimals, here->mean, unit, decimals, then->mean, unit, decimals,
            fabs(then->mean - here->mean), unit, decimals, limit);
    }
    struct command_text text = command_text_begin(advice, sizeof advice);
    command_text_print(&text, "move it%s (\"%s %.*f side=%s\"), calibrate again",
                       unset ? "" : " back", name, axis == CALIBRATION_PAN ? decimals : 0,
                       then->mean, side_name);
    return advise(message, advice, accept);
}

static int match_axes(const struct calibration_side_origin *made,
                      const struct calibration_side_origin *now, int side,
                      const struct pair_instrument *instrument, const char *accept,
                      struct message *message) {
    int error = ERROR_OK;
    for (int axis = 0; error == ERROR_OK && axis < CALIBRATION_AXES; axis++) {
        error = match_axis(&made->axis[axis], &now->axis[axis], side, axis, instrument, accept,
                           message);
    }
    return error;
}

int calibration_match(const struct calibration *calibration,
                      const struct calibration_match_state *state, const char *accept,
                      struct message *message) {
    const struct calibration_origin *made = &calibration->origin;
    const struct calibration_origin *now = &state->origin;
    int error = calibration->has_origin ? match_cameras(made, now, accept, message) : ERROR_OK;
    for (int side = 0; error == ERROR_OK && calibration->has_origin && side < RIG_SIDES; side++) {
        error = match_window(calibration, side, state, accept, message);
        if (error == ERROR_OK) {
            error = match_axes(&made->side[side], &now->side[side], side, &state->instrument,
                               accept, message);
        }
    }
    for (int side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        error = match_size(calibration, side, state, message);
    }
    return error;
}

void calibration_match_assume(const struct calibration *calibration,
                              struct calibration_match_state *state) {
    const struct calibration_origin *made = &calibration->origin;
    memcpy(state->origin.instrument, made->instrument, sizeof made->instrument);
    for (int side = 0; side < RIG_SIDES; side++) {
        memcpy(state->origin.side[side].camera, made->side[side].camera,
               sizeof made->side[side].camera);
    }
}

bool calibration_match_is_partial(const struct calibration *calibration,
                                  const struct calibration_origin *now) {
    for (int side = 0; side < RIG_SIDES; side++) {
        for (int axis = 0; axis < CALIBRATION_AXES; axis++) {
            const enum calibration_axis_kind made =
                calibration->has_origin ? calibration->origin.side[side].axis[axis].kind
                                        : CALIBRATION_AXIS_UNKNOWN;
            const enum calibration_axis_kind here = now->side[side].axis[axis].kind;
            if ((made == CALIBRATION_AXIS_KNOWN) != (here == CALIBRATION_AXIS_KNOWN)) {
                return true;
            }
        }
    }
    return false;
}

// ---- the standard deviation that all points share

static bool is_known(const struct calibration *calibration, int side, int axis) {
    return calibration->origin.side[side].axis[axis].kind == CALIBRATION_AXIS_KNOWN;
}

/// The share of the depth that a count of one camera's zoom changes: depth scales with the mean of
/// both focal lengths.
static double zoom_share_of(const struct pair_instrument *instrument) {
    return instrument->lens_zoom_ppm * share_per_ppm / RIG_SIDES;
}

/// Error of the depth because a side's pan and zoom were moved since the calibration; 0 where a
/// position is not known.
static double moved_mm(const struct calibration *calibration,
                       const struct pair_instrument *instrument,
                       const struct calibration_side_origin *now, int side, double depth_mm) {
    const struct calibration_axis *made = calibration->origin.side[side].axis;
    double moved[CALIBRATION_AXES] = {0};
    for (int axis = 0; axis < CALIBRATION_AXES; axis++) {
        if (made[axis].kind == CALIBRATION_AXIS_KNOWN &&
            now->axis[axis].kind == CALIBRATION_AXIS_KNOWN &&
            calibration_match_is_apart(instrument, axis, made[axis].mean, now->axis[axis].mean)) {
            moved[axis] = fabs(now->axis[axis].mean - made[axis].mean);
        }
    }
    return moved[CALIBRATION_PAN] * MATH_RAD_PER_DEGREE * depth_mm * depth_mm /
               calibration_baseline_mm(calibration) +
           moved[CALIBRATION_ZOOM] * zoom_share_of(instrument) * depth_mm;
}

double calibration_match_sigma_mm(const struct calibration *calibration,
                                  const struct pair_instrument *instrument,
                                  const struct calibration_origin *now, double depth_mm) {
    struct pair_instrument defaults;
    const bool given = instrument != NULL;
    INVARIANT(depth_mm >= 0);
    if (!calibration->has_origin) {
        return -1;
    }
    if (instrument == NULL) {
        struct rig_profile rig;
        const int error = rig_profile_named("rig", &rig);
        INVARIANT(error == ERROR_OK);
        defaults = calibration_match_instrument(&rig);
        instrument = &defaults;
    }
    const double pan_rad = limit_of(instrument, CALIBRATION_PAN) * MATH_RAD_PER_DEGREE;
    const double zoom_share = instrument->lens_repeatability_counts * zoom_share_of(instrument);
    const double own_mm = calibration_depth_sigma_mm(calibration, depth_mm);
    double sum_mm2 = own_mm * own_mm;
    for (int side = 0; side < RIG_SIDES && now != NULL; side++) {
        const double mm = moved_mm(calibration, instrument, &now->side[side], side, depth_mm);
        sum_mm2 += mm * mm;
    }
    for (int side = 0; side < RIG_SIDES && !calibration->axes_in_sigma; side++) {
        // A servo that was not set during calibration had an unknown position.
        const bool has_pan =
            calibration->origin.side[side].axis[CALIBRATION_PAN].kind != CALIBRATION_AXIS_NONE;
        if (is_known(calibration, side, CALIBRATION_PAN) ||
            (has_pan && given && instrument->servo_q4_per_rad[side] > 0)) {
            const double mm = pan_rad * depth_mm * depth_mm / calibration_baseline_mm(calibration);
            sum_mm2 += mm * mm;
        }
        if (is_known(calibration, side, CALIBRATION_ZOOM)) {
            const double mm = zoom_share * depth_mm;
            sum_mm2 += mm * mm;
        }
    }
    return sqrt(sum_mm2);
}

// SPDX-License-Identifier: Apache-2.0
#include "console/pair/calibration_at.h"

#include <math.h>
#include <string.h>

#include "console/command_text.h"
#include "core/cholesky.h"
#include "core/error.h"
#include "core/math.h"
#include "core/utf8.h"

int calibration_at_refused(const char *name, int error, const struct calibration_fault *fault,
                           struct message *message) {
    if (error == ERROR_CRC) {
        return command_text_message(
            message, error,
            "%s: checksum mismatch: the text was edited or damaged (expected %08x for this text)",
            name, (unsigned)fault->crc);
    }
    struct command_text text = command_text_begin(message->text, sizeof message->text);
    command_text_add(&text, name);
    if (fault->line > 0) {
        command_text_print(&text, ":%d", fault->line);
    }
    command_text_join(&text, ": ", fault->field, fault->field[0] != '\0' ? ": " : "",
                      fault->reason[0] != '\0' ? fault->reason : error_text(error));
    utf8_mask_controls(message->text);
    return error;
}

// Whether some combination of parameters would have a negative variance.
static bool covariance_is_possible(const struct zoom_calibration *zoom, const struct watch *watch,
                                   double *matrix) {
    static const double rounding = 1e-6;  // tolerance of correlations for rounding errors
    const int n = zoom->parameters;
    for (int i = 0; i < n; i++) {
        const double *row = &zoom->covariance[i * (i + 1) / 2];
        watch_serve(watch);
        for (int j = 0; j <= i; j++) {
            const double scale = sqrt(row[i] * zoom->covariance[j * (j + 1) / 2 + j]);
            const double correlation = scale > 0 ? row[j] / scale : 0;
            matrix[i * n + j] = i == j ? 1 + rounding : correlation;
        }
    }
    cholesky_factorize(matrix, n, 0);
    bool possible = true;
    for (int i = 0; i < n; i++) {
        possible = possible && matrix[i * n + i] > 0;
    }
    return possible;
}

int calibration_at_parse_zoom(const char *name, const char *text, size_t length,
                              const struct watch *watch, double *matrix,
                              struct zoom_calibration *zoom, struct message *message) {
    struct calibration_fault fault = {.field = "", .reason = ""};
    const int error = zoom_calibration_parse(text, length, watch, zoom, &fault);
    if (error != ERROR_OK) {
        return calibration_at_refused(name, error, &fault, message);
    }
    return covariance_is_possible(zoom, watch, matrix)
               ? ERROR_OK
               : command_text_message(message, ERROR_RANGE,
                                      "%s: the covariance is impossible (not positive "
                                      "semi-definite): calibrate again",
                                      name);
}

int calibration_at_axes(const struct calibration_match_state *axes, struct zoom_state *state,
                        struct message *message) {
    memset(state, 0, sizeof *state);
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct calibration_axis *axis = axes->origin.side[side].axis;
        static const int needed[] = {CALIBRATION_PAN, CALIBRATION_ZOOM, CALIBRATION_FOCUS};
        for (int i = 0; i < 3; i++) {
            if (axis[needed[i]].kind != CALIBRATION_AXIS_KNOWN) {
                return command_text_message(
                    message, ERROR_MISMATCH,
                    "%s %s is unknown%s: the calibration of all zooms cannot be used",
                    rig_side_names[side], calibration_reply_axis_name(needed[i]),
                    needed[i] == CALIBRATION_PAN ? " (not set since bring-up: run \"pan\")" : "");
            }
        }
        state->side[side].pan_rad = axis[CALIBRATION_PAN].mean * MATH_RAD_PER_DEGREE;
        state->side[side].zoom_counts = axis[CALIBRATION_ZOOM].mean;
        state->side[side].focus_counts = axis[CALIBRATION_FOCUS].mean;
    }
    return ERROR_OK;
}

// The axis that is outside its range, with position and range in its unit.
static int refuse_state(const struct zoom_calibration *zoom, const struct zoom_state *state,
                        const struct calibration_fault *fault, const char *advice,
                        struct message *message) {
    const int side = strncmp(fault->field, "left", 4) == 0 ? RIG_LEFT : RIG_RIGHT;
    const struct zoom_camera *camera = &zoom->camera[side];
    const bool pan = strstr(fault->field, "pan") != NULL;
    const bool focus = strstr(fault->field, "focus") != NULL;
    const struct zoom_range *range = &camera->zoom;
    double at = state->side[side].zoom_counts;
    int axis = CALIBRATION_ZOOM;
    if (pan) {
        range = &camera->pan_rad;
        at = state->side[side].pan_rad;
        axis = CALIBRATION_PAN;
    } else if (focus) {
        range = &camera->focus;
        at = state->side[side].focus_counts;
        axis = CALIBRATION_FOCUS;
    }
    const double unit = pan ? MATH_RAD_PER_DEGREE : 1;
    return command_text_message(
        message, ERROR_MISMATCH, "%s %s is at %.*f %s, outside the calibrated %.*f to %.*f %s%s",
        rig_side_names[side], calibration_reply_axis_name(axis), pan ? 3 : 1, at / unit,
        calibration_reply_axis_unit(axis), pan ? 3 : 1, range->min / unit, pan ? 3 : 1,
        range->max / unit, calibration_reply_axis_unit(axis), advice);
}

int calibration_at_state(const struct zoom_calibration *zoom, const struct zoom_state *state,
                         const char *advice, struct calibration *calibration,
                         struct message *message) {
    struct calibration_fault fault = {.field = "", .reason = ""};
    const int error = zoom_state_check(zoom, state, &fault);
    if (error != ERROR_OK) {
        return refuse_state(zoom, state, &fault, advice, message);
    }
    const int code = zoom_calibration_at(zoom, state, calibration, &fault);
    return code == ERROR_OK
               ? ERROR_OK
               : calibration_at_refused("the calibration of this state", code, &fault, message);
}

int calibration_at(const char *name, const char *text, size_t length,
                   struct calibration *calibration, struct message *message) {
    struct calibration_fault fault = {.field = "", .reason = ""};
    if (zoom_calibration_is_text(text, length)) {
        return command_text_message(
            message, ERROR_MISSING,
            "%s: is a calibration of all zooms: it needs a captured pair, or a "
            "state (vergence info FILE --at)",
            name);
    }
    const int error = calibration_parse(text, length, calibration, &fault);
    return error == ERROR_OK ? ERROR_OK : calibration_at_refused(name, error, &fault, message);
}

int calibration_at_zoom(const struct zoom_calibration *zoom,
                        const struct calibration_match_state *axes, struct calibration *calibration,
                        struct message *message) {
    struct zoom_state state;
    int error = calibration_at_axes(axes, &state, message);
    if (error == ERROR_OK) {
        error = calibration_at_state(zoom, &state, ": move it there, or calibrate more",
                                     calibration, message);
    }
    for (int side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        // The iris too, which does not matter, and how far the axes moved during the pair.
        memcpy(calibration->origin.side[side].axis, axes->origin.side[side].axis,
               sizeof axes->origin.side[side].axis);
    }
    return error;
}

// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/zoom/zoom_calibration.h"
#include "stereo/zoom/zoom_sigma.h"

// How far beyond its calibrated range a position may lie, in standard deviations of the motors.
static const double margin_sigmas = 4;

static bool is_outside(const struct zoom_range *range, double margin, double value) {
    INVARIANT(margin >= 0 && range->min <= range->max);
    return !(value >= range->min - margin && value <= range->max + margin);
}

int zoom_state_check(const struct zoom_calibration *calibration, const struct zoom_state *state,
                     struct calibration_fault *fault) {
    static const char *const names[2][3] = {
        {"left_zoom_counts", "left_focus_counts", "left_pan_rad"},
        {"right_zoom_counts", "right_focus_counts", "right_pan_rad"},
    };
    INVARIANT(calibration != NULL && state != NULL);
    for (int side = 0; side < 2; side++) {
        const struct zoom_camera *camera = &calibration->camera[side];
        INVARIANT(camera->reading_sigma_counts >= 0 && camera->drift_sigma_counts >= 0);
        const double counts = sqrt(camera->reading_sigma_counts * camera->reading_sigma_counts +
                                   camera->drift_sigma_counts * camera->drift_sigma_counts);
        const bool outside[3] = {
            is_outside(&camera->zoom, margin_sigmas * counts, state->side[side].zoom_counts),
            is_outside(&camera->focus, margin_sigmas * counts, state->side[side].focus_counts),
            is_outside(&camera->pan_rad, margin_sigmas * camera->pan_sigma_rad,
                       state->side[side].pan_rad),
        };
        for (int axis = 0; axis < 3; axis++) {
            if (outside[axis]) {
                if (fault != NULL) {
                    *fault = (struct calibration_fault){.field = names[side][axis],
                                                        .reason = "outside the calibrated range"};
                }
                return ERROR_RANGE;
            }
        }
    }
    return ERROR_OK;
}

static void set_origin(const struct zoom_calibration *calibration, const struct zoom_state *state,
                       struct calibration *result) {
    result->has_origin = true;
    memcpy(result->origin.instrument, calibration->instrument, sizeof calibration->instrument);
    for (int side = 0; side < 2; side++) {
        struct calibration_side_origin *origin = &result->origin.side[side];
        memcpy(origin->camera, calibration->camera[side].name, sizeof origin->camera);
        origin->window = (struct calibration_window){0, 0, 1};
        origin->axis[CALIBRATION_PAN] = (struct calibration_axis){
            CALIBRATION_AXIS_KNOWN, state->side[side].pan_rad * (180 / MATH_PI), 0};
        origin->axis[CALIBRATION_ZOOM] =
            (struct calibration_axis){CALIBRATION_AXIS_KNOWN, state->side[side].zoom_counts, 0};
        origin->axis[CALIBRATION_FOCUS] =
            (struct calibration_axis){CALIBRATION_AXIS_KNOWN, state->side[side].focus_counts, 0};
    }
}

int zoom_calibration_at(const struct zoom_calibration *calibration, const struct zoom_state *state,
                        struct calibration *result, struct calibration_fault *fault) {
    int code = zoom_state_check(calibration, state, fault);
    if (code != ERROR_OK) {
        return code;
    }
    struct zoom_pair pair;
    zoom_pair_at(calibration->camera, state, &pair);
    struct calibration at;
    memset(&at, 0, sizeof at);
    memcpy(at.id, calibration->id, sizeof at.id);
    memcpy(at.date, calibration->date, sizeof at.date);
    memcpy(at.note, calibration->note, sizeof at.note);
    at.rms_px = calibration->validation.rms_px;
    set_origin(calibration, state, &at);
    code = zoom_pair_calibration(&pair, &at);
    if (code == ERROR_OK) {
        zoom_depth_sigma(calibration, state, &at.scale_sigma, &at.yaw_sigma_rad);
        INVARIANT(at.scale_sigma >= calibration->scale_sigma && at.yaw_sigma_rad >= 0);
        at.axes_in_sigma = true;
        code = calibration_validate(&at, fault);
    }
    if (code == ERROR_OK) {
        *result = at;
    }
    return code;
}

// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/zoom_aim.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

void zoom_point_ahead(const struct zoom_calibration *calibration, double distance_mm,
                      double right_mm, double point_mm[3]) {
    const double *left = &calibration->camera[0].mount[ZOOM_POSITION_X];
    const double *right = &calibration->camera[1].mount[ZOOM_POSITION_X];
    for (int i = 0; i < 3; i++) {
        point_mm[i] = (left[i] + right[i]) / 2;
    }
    point_mm[0] += right_mm;
    point_mm[2] += distance_mm;
}

// Angle about the vertical from a camera's axis to the point, positive to the right.
static double bearing_rad(const struct zoom_pair *pair, int side, const double point_mm[3]) {
    INVARIANT(side == 0 || side == 1);
    double arm_mm[3], in_camera_mm[3];
    for (int i = 0; i < 3; i++) {
        arm_mm[i] = point_mm[i] - pair->side[side].position_mm[i];
    }
    geometry_rotate_back(pair->side[side].R_instrument_camera, arm_mm, in_camera_mm);
    return math_atan2(in_camera_mm[0], in_camera_mm[2]);
}

int zoom_aim(const struct zoom_calibration *calibration, const double point_mm[3],
             struct zoom_state *state, struct calibration_fault *fault) {
    static const char *const names[2] = {"left_pan_rad", "right_pan_rad"};
    INVARIANT(point_mm != NULL);
    struct zoom_state aimed = *state;
    double off_rad[2] = {0, 0};
    // The pupil moves by little, so that each step leaves a small share of the angle.
    for (int i = 0; i < 30; i++) {
        struct zoom_pair pair;
        zoom_pair_at(calibration->camera, &aimed, &pair);
        for (int side = 0; side < 2; side++) {
            off_rad[side] = bearing_rad(&pair, side, point_mm);
            aimed.side[side].pan_rad +=
                off_rad[side] / (1 + calibration->camera[side].mount[ZOOM_PAN_SCALE]);
        }
    }
    for (int side = 0; side < 2; side++) {
        const struct zoom_range *range = &calibration->camera[side].pan_rad;
        const double pan_rad = aimed.side[side].pan_rad;
        if (!(fabs(off_rad[side]) < 1e-6 && pan_rad >= range->min - 1e-6 &&
              pan_rad <= range->max + 1e-6)) {
            if (fault != NULL) {
                *fault = (struct calibration_fault){.field = names[side],
                                                    .reason = "outside the calibrated range"};
            }
            return ERROR_RANGE;
        }
    }
    *state = aimed;
    return ERROR_OK;
}

double zoom_focus_counts(const struct zoom_camera *camera, double zoom_counts, double distance_mm) {
    INVARIANT(distance_mm > 0);
    const double f_px = zoom_function_value(camera, ZOOM_FOCAL, zoom_counts);
    const double missing =
        1000 / distance_mm - zoom_function_value(camera, ZOOM_FOCUS_DIOPTRE, math_log(f_px));
    // a T_1(u) + b T_2(u) = missing, from the solution without b.
    const double a = camera->focus_dioptre_by_count[0], b = camera->focus_dioptre_by_count[1];
    double u = a != 0 ? missing / a : 0;
    for (int i = 0; i < 30 && a + 4 * b * u != 0; i++) {
        u -= (a * u + b * (2 * u * u - 1) - missing) / (a + 4 * b * u);
    }
    const struct zoom_range *focus = &camera->focus;
    INVARIANT(focus->max > focus->min);
    return (focus->min + focus->max + u * (focus->max - focus->min)) / 2;
}

// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/zoom_calibration.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

int zoom_parameter_list(struct zoom_camera camera[2], double *parameter[ZOOM_PARAMETERS_MAX]) {
    int count = 0;
    for (int side = 0; side < 2; side++) {
        for (int name = 0; name < ZOOM_FUNCTIONS; name++) {
            struct zoom_function *function = &camera[side].function[name];
            INVARIANT(function->terms >= 0 && function->terms <= ZOOM_TERMS_MAX);
            for (int i = 0; i < function->terms; i++) {
                parameter[count++] = &function->term[i];
            }
        }
        for (int i = 0; i < ZOOM_FOCUS_TERMS; i++) {
            parameter[count++] = &camera[side].focus_dioptre_by_count[i];
        }
        const int mount = side == 0 ? ZOOM_ROTATION_X : ZOOM_MOUNT_PARAMETERS;
        for (int i = 0; i < mount; i++) {
            parameter[count++] = &camera[side].mount[i];
        }
    }
    INVARIANT(count <= ZOOM_PARAMETERS_MAX);
    return count;
}

double zoom_range_unit(const struct zoom_range *range, double value) {
    INVARIANT(range->max > range->min);
    return (2 * value - range->min - range->max) / (range->max - range->min);
}

void zoom_chebyshev(double u, int count, double *value) {
    INVARIANT(count >= 0 && count <= ZOOM_TERMS_MAX);
    for (int i = 0; i < count; i++) {
        if (i < 2) {
            value[i] = i == 0 ? 1 : u;
            continue;
        }
        value[i] = 2 * u * value[i - 1] - value[i - 2];
    }
}

double zoom_function_value(const struct zoom_camera *camera, enum zoom_function_name name,
                           double argument) {
    INVARIANT((unsigned)name < ZOOM_FUNCTIONS);
    const struct zoom_function *function = &camera->function[name];
    INVARIANT(function->terms >= 0 && function->terms <= ZOOM_TERMS_MAX);
    double polynomial[ZOOM_TERMS_MAX], sum = 0;
    zoom_chebyshev(
        zoom_range_unit(name == ZOOM_FOCAL ? &camera->zoom : &camera->log_focal, argument),
        function->terms, polynomial);
    for (int i = 0; i < function->terms; i++) {
        sum += function->term[i] * polynomial[i];
    }
    return sum;
}

void zoom_values_at(const struct zoom_camera *camera, const struct zoom_camera_state *state,
                    double f_px, double value[ZOOM_FUNCTIONS]) {
    INVARIANT(camera->focus.max > camera->focus.min);
    const double log_focal = math_log(f_px);
    value[ZOOM_FOCAL] = f_px;
    for (int name = ZOOM_FOCAL + 1; name < ZOOM_FUNCTIONS; name++) {
        value[name] = zoom_function_value(camera, (enum zoom_function_name)name, log_focal) +
                      state->deviation[name];
    }
    const double u = zoom_range_unit(&camera->focus, state->focus_counts);
    value[ZOOM_FOCUS_DIOPTRE] +=
        camera->focus_dioptre_by_count[0] * u + camera->focus_dioptre_by_count[1] * (2 * u * u - 1);
}

double zoom_focal_ratio(const struct zoom_camera *camera, const double value[ZOOM_FUNCTIONS]) {
    INVARIANT(camera->pixel_mm > 0);
    return 1 - value[ZOOM_FOCAL] * camera->pixel_mm * value[ZOOM_FOCUS_DIOPTRE] / 1000;
}

// Lens of the whole sensor from the values of its functions.
static void lens_at(const struct zoom_camera *camera, const double value[ZOOM_FUNCTIONS],
                    struct lens *lens) {
    INVARIANT(camera->radius_px > 0);
    const double F_px = value[ZOOM_FOCAL] / zoom_focal_ratio(camera, value);
    const double R = camera->radius_px, slope = F_px / R, square = slope * slope;
    *lens = (struct lens){.width_px = camera->width_px,
                          .height_px = camera->height_px,
                          .fx_px = F_px,
                          .fy_px = F_px,
                          .cx_px = value[ZOOM_CENTRE_X],
                          .cy_px = value[ZOOM_CENTRE_Y],
                          .k1 = value[ZOOM_RADIAL_2] / R * square,
                          .k2 = value[ZOOM_RADIAL_4] / R * square * square,
                          .k3 = value[ZOOM_RADIAL_6] / R * square * square * square,
                          .p1 = value[ZOOM_TANGENTIAL_1] / R * slope,
                          .p2 = value[ZOOM_TANGENTIAL_2] / R * slope};
}

void zoom_pose_at(const struct zoom_camera *camera, double angle_rad, double pupil_mm, double R[9],
                  double position_mm[3]) {
    const double *mount = camera->mount;
    const double axis[3] = {mount[ZOOM_AXIS_DIRECTION_X], 1, mount[ZOOM_AXIS_DIRECTION_Z]};
    const double length = geometry_norm(axis);
    INVARIANT(axis[1] == 1 && length >= 1);
    double turn[3], pan[9], at_zero[9], arm_mm[3], turned_mm[3];
    for (int i = 0; i < 3; i++) {
        turn[i] = axis[i] * (angle_rad / length);
    }
    geometry_rotation_from_vector(turn, pan);
    geometry_rotation_from_vector(&mount[ZOOM_ROTATION_X], at_zero);
    geometry_multiply(pan, at_zero, R);
    const double point_mm[3] = {mount[ZOOM_AXIS_POINT_X], 0, mount[ZOOM_AXIS_POINT_Z]};
    for (int i = 0; i < 3; i++) {
        arm_mm[i] = mount[ZOOM_POSITION_X + i] + at_zero[3 * i + 2] * pupil_mm - point_mm[i];
    }
    geometry_rotate(pan, arm_mm, turned_mm);
    for (int i = 0; i < 3; i++) {
        position_mm[i] = point_mm[i] + turned_mm[i];
    }
}

void zoom_pair_at(const struct zoom_camera camera[2], const struct zoom_state *state,
                  struct zoom_pair *pair) {
    for (int side = 0; side < 2; side++) {
        const struct zoom_camera *own = &camera[side];
        const struct zoom_camera_state *at = &state->side[side];
        double value[ZOOM_FUNCTIONS];
        zoom_values_at(
            own, at,
            zoom_function_value(own, ZOOM_FOCAL, at->zoom_counts) + at->deviation[ZOOM_FOCAL],
            value);
        pair->side[side].f_px = value[ZOOM_FOCAL];
        pair->side[side].focus_dioptre = value[ZOOM_FOCUS_DIOPTRE];
        lens_at(own, value, &pair->side[side].lens);
        zoom_pose_at(own, at->pan_rad * (1 + own->mount[ZOOM_PAN_SCALE]), value[ZOOM_PUPIL],
                     pair->side[side].R_instrument_camera, pair->side[side].position_mm);
    }
}

int zoom_pair_calibration(const struct zoom_pair *pair, struct calibration *result) {
    result->left = pair->side[0].lens;
    result->right = pair->side[1].lens;
    return geometry_relative_pose(pair->side[0].R_instrument_camera, pair->side[0].position_mm,
                                  pair->side[1].R_instrument_camera, pair->side[1].position_mm,
                                  result->rotation_right_left_rad,
                                  result->translation_right_left_mm);
}

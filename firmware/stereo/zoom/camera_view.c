// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/camera_view.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

// Radius in px at which distortion is stated.
static double corner_px(const struct lens *lens) {
    const double width = lens->width_px, height = lens->height_px;
    return 0.5 * sqrt(width * width + height * height);
}

// Displacements in px at the corner that correspond to the coefficients, in the order of the terms.
static void to_pixels(const struct lens *lens, double pixels[5]) {
    const double corner = corner_px(lens);
    const double r = corner / lens->fx_px;
    const double r2 = r * r;
    pixels[0] = lens->k1 * r2 * corner;
    pixels[1] = lens->k2 * r2 * r2 * corner;
    pixels[2] = lens->k3 * r2 * r2 * r2 * corner;
    pixels[3] = lens->p1 * r * corner;
    pixels[4] = lens->p2 * r * corner;
}

static void from_pixels(const double pixels[5], struct lens *lens) {
    const double corner = corner_px(lens);
    const double r = corner / lens->fx_px;
    const double r2 = r * r;
    lens->k1 = pixels[0] / (r2 * corner);
    lens->k2 = pixels[1] / (r2 * r2 * corner);
    lens->k3 = pixels[2] / (r2 * r2 * r2 * corner);
    lens->p1 = pixels[3] / (r * corner);
    lens->p2 = pixels[4] / (r * corner);
}

void camera_view_correct(const struct camera_view *base, const double correction[VIEW_TERMS],
                         struct camera_view *result) {
    double pixels[5];
    to_pixels(&base->lens, pixels);
    struct camera_view corrected = *base;
    struct lens *lens = &corrected.lens;
    lens->fx_px = base->lens.fx_px * math_exp(correction[VIEW_FOCAL]);
    lens->fy_px = lens->fx_px;
    lens->cx_px += correction[VIEW_CENTRE_X];
    lens->cy_px += correction[VIEW_CENTRE_Y];
    for (int i = 0; i < 5; i++) {
        pixels[i] += correction[VIEW_RADIAL_2 + i];
    }
    from_pixels(pixels, lens);
    INVARIANT(lens->fx_px > 0);
    double turn[9];
    geometry_rotation_from_vector(correction + VIEW_ROTATION_X, turn);
    geometry_multiply(turn, base->R_instrument_camera, corrected.R_instrument_camera);
    for (int i = 0; i < 3; i++) {
        corrected.position_mm[i] += correction[VIEW_POSITION_X + i];
    }
    *result = corrected;
}

void camera_view_difference(const struct camera_view *to, const struct camera_view *from,
                            double correction[VIEW_TERMS]) {
    double pixels_to[5], pixels_from[5];
    to_pixels(&to->lens, pixels_to);
    to_pixels(&from->lens, pixels_from);
    correction[VIEW_FOCAL] = math_log(to->lens.fx_px / from->lens.fx_px);
    correction[VIEW_CENTRE_X] = to->lens.cx_px - from->lens.cx_px;
    correction[VIEW_CENTRE_Y] = to->lens.cy_px - from->lens.cy_px;
    for (int i = 0; i < 5; i++) {
        correction[VIEW_RADIAL_2 + i] = pixels_to[i] - pixels_from[i];
    }
    // To first order, turn = I + [r]x.
    const double *a = to->R_instrument_camera, *b = from->R_instrument_camera;
    double turn[9];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            turn[3 * i + j] = geometry_dot(a + 3 * i, b + 3 * j);
        }
    }
    correction[VIEW_ROTATION_X] = 0.5 * (turn[7] - turn[5]);
    correction[VIEW_ROTATION_Y] = 0.5 * (turn[2] - turn[6]);
    correction[VIEW_ROTATION_Z] = 0.5 * (turn[3] - turn[1]);
    for (int i = 0; i < 3; i++) {
        correction[VIEW_POSITION_X + i] = to->position_mm[i] - from->position_mm[i];
    }
}

bool camera_view_ray(const struct camera_view *view, const double pixel_px[2],
                     double direction[3]) {
    double ray[3];
    if (!lens_ray(&view->lens, pixel_px, ray)) {
        return false;
    }
    geometry_rotate(view->R_instrument_camera, ray, direction);
    return true;
}

static void lens_derivatives(const struct lens *lens, const double ideal[2], const double slope[4],
                             double (*of_view)[VIEW_TERMS]) {
    const double f = lens->fx_px, corner = corner_px(lens);
    const double x = f * ideal[0], y = f * ideal[1];
    const double r2 = (x * x + y * y) / (corner * corner);
    for (int i = 0; i < 2; i++) {
        double *row = of_view[i];
        row[VIEW_FOCAL] = slope[2 * i] * x + slope[2 * i + 1] * y;
        row[VIEW_CENTRE_X] = i == 0;
        row[VIEW_CENTRE_Y] = i == 1;
        const double own = (i == 0 ? x : y) / corner;
        row[VIEW_RADIAL_2] = own * r2;
        row[VIEW_RADIAL_4] = own * r2 * r2;
        row[VIEW_RADIAL_6] = own * r2 * r2 * r2;
    }
    const double u = x / corner, v = y / corner;
    of_view[0][VIEW_TANGENTIAL_1] = 2.0 * u * v;
    of_view[1][VIEW_TANGENTIAL_1] = r2 + 2.0 * v * v;
    of_view[0][VIEW_TANGENTIAL_2] = r2 + 2.0 * u * u;
    of_view[1][VIEW_TANGENTIAL_2] = 2.0 * u * v;
}

bool camera_view_project(const struct camera_view *view, const struct far_point *point,
                         double pixel_px[2], double (*of_view)[VIEW_TERMS], double (*of_point)[3]) {
    const double ray[3] = {point->x, point->y, 1};
    double arm[3], direction[3], seen[3];
    for (int i = 0; i < 3; i++) {
        arm[i] = point->origin_mm[i] - view->position_mm[i];
        direction[i] = ray[i] + point->w * arm[i];
    }
    geometry_rotate_back(view->R_instrument_camera, direction, seen);
    if (!(seen[2] > 0)) {
        return false;
    }
    const struct lens *lens = &view->lens;
    const double ideal[2] = {seen[0] / seen[2], seen[1] / seen[2]};
    double distorted[2];
    lens_distort(lens, ideal, distorted);
    pixel_px[0] = lens->cx_px + lens->fx_px * distorted[0];
    pixel_px[1] = lens->cy_px + lens->fy_px * distorted[1];
    if (of_view == NULL) {
        return true;
    }
    double slope[4];
    lens_distort_slope(lens, ideal, slope);
    lens_derivatives(lens, ideal, slope, of_view);
    const double *R = view->R_instrument_camera;
    for (int i = 0; i < 2; i++) {
        // Of this coordinate with respect to `seen`, then to `direction`.
        const double a = lens->fx_px * slope[2 * i] / seen[2],
                     b = lens->fx_px * slope[2 * i + 1] / seen[2];
        const double of_seen[3] = {a, b, -a * ideal[0] - b * ideal[1]};
        double of_direction[3], of_turn[3];
        geometry_rotate(R, of_seen, of_direction);
        // The camera turns by r: the direction, seen from it, by -r.
        geometry_cross(of_direction, direction, of_turn);
        for (int k = 0; k < 3; k++) {
            of_view[i][VIEW_ROTATION_X + k] = of_turn[k];
            of_view[i][VIEW_POSITION_X + k] = -point->w * of_direction[k];
        }
        of_point[i][0] = of_direction[0];
        of_point[i][1] = of_direction[1];
        of_point[i][2] = geometry_dot(of_direction, arm);
    }
    return true;
}

void camera_view_pair(const struct camera_view *left, const struct camera_view *right,
                      struct calibration *result) {
    result->left = left->lens;
    result->right = right->lens;
    const int error = geometry_relative_pose(
        left->R_instrument_camera, left->position_mm, right->R_instrument_camera,
        right->position_mm, result->rotation_right_left_rad, result->translation_right_left_mm);
    INVARIANT(error == ERROR_OK);
    (void)error;
}

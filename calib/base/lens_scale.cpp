// SPDX-License-Identifier: Apache-2.0
#include "calib/base/lens_scale.hpp"

#include <cmath>

#include "core/invariant.h"

namespace calib {

namespace {

// Image point without distortion, in units of the reference radius.
struct ideal_point {
    double s, t, rho2;
};

// Displacement by the lens: (s, t) times `radial` plus the tangential terms.
double radial_factor(const lens_frame &frame, const lens_state &lens, double rho2) {
    const auto &q = lens.value;
    return 1 + rho2 * (q[RADIAL_2] + rho2 * (q[RADIAL_4] + rho2 * q[RADIAL_6])) / frame.radius_px;
}

// Distorted position in px from the principal point, before the rows are stretched. False when it
// overflows.
bool distort(const lens_frame &frame, const lens_state &lens, const ideal_point &at,
             double result[2]) {
    const double radial = radial_factor(frame, lens, at.rho2) * frame.radius_px;
    const double p1 = lens.value[TANGENTIAL_1], p2 = lens.value[TANGENTIAL_2];
    result[0] = at.s * radial + 2 * p1 * at.s * at.t + p2 * (at.rho2 + 2 * at.s * at.s);
    result[1] = at.t * radial + p1 * (at.rho2 + 2 * at.t * at.t) + 2 * p2 * at.s * at.t;
    return std::isfinite(result[0]) && std::isfinite(result[1]);
}

ideal_point ideal_of(const lens_frame &frame, double focal_px, const double point_mm[3]) {
    const double scale = focal_px / (frame.radius_px * point_mm[2]);
    const double s = point_mm[0] * scale, t = point_mm[1] * scale;
    return {s, t, s * s + t * t};
}

// Derivatives of `distort` by the ideal position in px: {{d[0], d[1]}, {d[1], d[2]}}.
void distortion_slope(const lens_frame &frame, const lens_state &lens, const ideal_point &at,
                      double slope[3]) {
    const auto &q = lens.value;
    const double inverse = 1 / frame.radius_px;
    const double radial = radial_factor(frame, lens, at.rho2);
    const double turn =
        2 * inverse * (q[RADIAL_2] + at.rho2 * (2 * q[RADIAL_4] + at.rho2 * 3 * q[RADIAL_6]));
    const double p1 = q[TANGENTIAL_1] * inverse, p2 = q[TANGENTIAL_2] * inverse;
    slope[0] = radial + turn * at.s * at.s + 2 * p1 * at.t + 6 * p2 * at.s;
    slope[1] = turn * at.s * at.t + 2 * p1 * at.s + 2 * p2 * at.t;
    slope[2] = radial + turn * at.t * at.t + 6 * p1 * at.t + 2 * p2 * at.s;
}

}  // namespace

lens_frame make_lens_frame(int width_px, int height_px) {
    INVARIANT(width_px >= 1 && height_px >= 1);
    lens_frame frame;
    frame.width_px = width_px;
    frame.height_px = height_px;
    frame.middle_x_px = 0.5 * (width_px - 1);
    frame.middle_y_px = 0.5 * (height_px - 1);
    frame.radius_px = 0.5 * std::sqrt(double(width_px) * width_px + double(height_px) * height_px);
    return frame;
}

lens lens_from_state(const lens_frame &frame, const lens_state &state) {
    INVARIANT(frame.radius_px > 0);
    const auto &q = state.value;
    lens result = {};
    result.width_px = frame.width_px;
    result.height_px = frame.height_px;
    result.fx_px = std::exp(q[LOG_FOCAL]);
    result.fy_px = result.fx_px * std::exp(q[LOG_ASPECT]);
    result.cx_px = frame.middle_x_px + q[CENTRE_X];
    result.cy_px = frame.middle_y_px + q[CENTRE_Y];
    const double inverse = result.fx_px / frame.radius_px;  // of the ideal reference radius
    const double square = inverse * inverse;
    result.k1 = q[RADIAL_2] / frame.radius_px * square;
    result.k2 = q[RADIAL_4] / frame.radius_px * square * square;
    result.k3 = q[RADIAL_6] / frame.radius_px * square * square * square;
    result.p1 = q[TANGENTIAL_1] / frame.radius_px * inverse;
    result.p2 = q[TANGENTIAL_2] / frame.radius_px * inverse;
    return result;
}

lens_state state_from_lens(const lens_frame &frame, const lens &lens) {
    INVARIANT(frame.radius_px > 0 && lens.fx_px > 0 && lens.fy_px > 0);
    lens_state state;
    auto &q = state.value;
    const double radius = frame.radius_px / lens.fx_px;
    const double square = radius * radius;
    q[LOG_FOCAL] = std::log(lens.fx_px);
    q[LOG_ASPECT] = std::log(lens.fy_px / lens.fx_px);
    q[CENTRE_X] = lens.cx_px - frame.middle_x_px;
    q[CENTRE_Y] = lens.cy_px - frame.middle_y_px;
    q[RADIAL_2] = lens.k1 * frame.radius_px * square;
    q[RADIAL_4] = lens.k2 * frame.radius_px * square * square;
    q[RADIAL_6] = lens.k3 * frame.radius_px * square * square * square;
    q[TANGENTIAL_1] = lens.p1 * frame.radius_px * radius;
    q[TANGENTIAL_2] = lens.p2 * frame.radius_px * radius;
    return state;
}

bool project(const lens_frame &frame, const lens_state &state, const double point_mm[3],
             double pixel_px[2]) {
    const auto &q = state.value;
    double moved[2];
    if (!(point_mm[2] > 0) ||
        !distort(frame, state, ideal_of(frame, std::exp(q[LOG_FOCAL]), point_mm), moved)) {
        return false;
    }
    pixel_px[0] = frame.middle_x_px + q[CENTRE_X] + moved[0];
    pixel_px[1] = frame.middle_y_px + q[CENTRE_Y] + std::exp(q[LOG_ASPECT]) * moved[1];
    return true;
}

bool project(const lens_frame &frame, const lens_state &state, const double point_mm[3],
             projection *result) {
    if (!(point_mm[2] > 0)) {
        return false;
    }
    const auto &q = state.value;
    const double focal = std::exp(q[LOG_FOCAL]), aspect = std::exp(q[LOG_ASPECT]);
    const ideal_point at = ideal_of(frame, focal, point_mm);
    double moved[2], slope[3];
    if (!distort(frame, state, at, moved)) {
        return false;
    }
    distortion_slope(frame, state, at, slope);
    const double s = at.s, t = at.t, rho2 = at.rho2, radius = frame.radius_px;

    result->pixel_px[0] = frame.middle_x_px + q[CENTRE_X] + moved[0];
    result->pixel_px[1] = frame.middle_y_px + q[CENTRE_Y] + aspect * moved[1];
    for (int axis = 0; axis < 2; axis++) {
        const double stretch = axis == 0 ? 1 : aspect;
        const double by_u = stretch * slope[axis], by_v = stretch * slope[axis + 1];
        const double inverse_z = 1 / point_mm[2];
        double *by_point = result->by_point[axis], *by_lens = result->by_lens[axis];
        by_point[0] = by_u * focal * inverse_z;
        by_point[1] = by_v * focal * inverse_z;
        by_point[2] = -(by_u * s + by_v * t) * radius * inverse_z;
        by_lens[LOG_FOCAL] = (by_u * s + by_v * t) * radius;
        by_lens[LOG_ASPECT] = axis == 0 ? 0 : aspect * moved[1];
        by_lens[CENTRE_X] = axis == 0;
        by_lens[CENTRE_Y] = axis == 1;
        const double along = stretch * (axis == 0 ? s : t);
        by_lens[RADIAL_2] = along * rho2;
        by_lens[RADIAL_4] = along * rho2 * rho2;
        by_lens[RADIAL_6] = along * rho2 * rho2 * rho2;
        by_lens[TANGENTIAL_1] = stretch * (axis == 0 ? 2 * s * t : rho2 + 2 * t * t);
        by_lens[TANGENTIAL_2] = stretch * (axis == 0 ? rho2 + 2 * s * s : 2 * s * t);
    }
    return true;
}

bool lens_model::estimates(int parameter) const {
    switch (parameter) {
        case LOG_ASPECT:
            return !square_pixels;
        case RADIAL_2:
            return distortion >= K1;
        case RADIAL_4:
            return distortion >= K1_K2;
        case TANGENTIAL_1:
        case TANGENTIAL_2:
            return distortion >= K1_K2_P1_P2;
        case RADIAL_6:
            return distortion >= K1_K2_P1_P2_K3;
        default:
            return true;
    }
}

int lens_model::count() const {
    int parameters = 0;
    for (int parameter = 0; parameter < LENS_PARAMETERS; parameter++) {
        parameters += estimates(parameter);
    }
    return parameters;
}

const char *lens_model_name(lens_model model) {
    INVARIANT(model.distortion >= lens_model::NONE && model.distortion < lens_model::KINDS);
    static const char *const names[2][lens_model::KINDS] = {
        {"no distortion, free fy", "k1, free fy", "k1 k2, free fy", "k1 k2 p1 p2, free fy",
         "k1 k2 p1 p2 k3, free fy"},
        {"no distortion", "k1", "k1 k2", "k1 k2 p1 p2", "k1 k2 p1 p2 k3"}};
    return names[model.square_pixels][model.distortion];
}

const char *board_model_name(board_model model) {
    static const char *const names[2][2] = {{"flat", "flat, print stretched"},
                                            {"bent", "bent, print stretched"}};
    return names[model.bent][model.stretched];
}

}  // namespace calib

// SPDX-License-Identifier: Apache-2.0
#include "calib/base/lens_scale.hpp"

#include <cmath>
#include <vector>

#include "calib/base/linear.hpp"
#include "core/invariant.h"
#include "core/math.h"

namespace calib {

namespace {

// Image point without distortion, in units of the reference radius.
struct ideal_point {
    double s, t, rho2;
};

// The radial factor, and the denominator in it.
struct radial_part {
    double factor, below;
};

radial_part radial_at(const lens_state &lens, double radius_px, double rho2) {
    const auto &q = lens.value;
    const bool equidistant = lens.kind == LENS_EQUIDISTANT;
    const double last = equidistant ? q[RADIAL_6] + rho2 * q[K4] : q[RADIAL_6];
    const double above = 1 + rho2 * (q[RADIAL_2] + rho2 * (q[RADIAL_4] + rho2 * last)) / radius_px;
    if (lens.kind != LENS_RATIONAL) {
        return {above, 1};
    }
    const double below = 1 + rho2 * (q[K4] + rho2 * (q[K5] + rho2 * q[K6])) / radius_px;
    return {above / below, below};
}

// Distorted position in px from the principal point, before the rows are stretched. False when it
// overflows, or is behind a pole.
bool distort(const lens_frame &frame, const lens_state &lens, const ideal_point &at,
             double result[2]) {
    const radial_part part = radial_at(lens, frame.radius_px, at.rho2);
    const double radial = part.factor * frame.radius_px;
    const double p1 = lens.value[TANGENTIAL_1], p2 = lens.value[TANGENTIAL_2];
    result[0] = at.s * radial + 2 * p1 * at.s * at.t + p2 * (at.rho2 + 2 * at.s * at.s);
    result[1] = at.t * radial + p1 * (at.rho2 + 2 * at.t * at.t) + 2 * p2 * at.s * at.t;
    return part.below > 0 && std::isfinite(result[0]) && std::isfinite(result[1]);
}

// False where the lens has no image of the point.
bool ideal_of(const lens_frame &frame, const lens_state &lens, double focal_px,
              const double point_mm[3], ideal_point *at) {
    if (lens.kind != LENS_EQUIDISTANT) {
        const double scale = focal_px / (frame.radius_px * point_mm[2]);
        const double s = point_mm[0] * scale, t = point_mm[1] * scale;
        *at = {s, t, s * s + t * t};
        return point_mm[2] > 0;
    }
    const double across = std::hypot(point_mm[0], point_mm[1]);
    const double angle = std::atan2(across, point_mm[2]);
    const double per_mm = across > 0 ? angle / across : 1 / point_mm[2];
    const double scale = focal_px / frame.radius_px * per_mm;
    const double s = point_mm[0] * scale, t = point_mm[1] * scale;
    *at = {s, t, s * s + t * t};
    return across > 0 || point_mm[2] > 0;
}

// Derivatives of an equidistant lens's ideal position in px by the point in mm.
void angle_slope(double focal_px, const double point_mm[3], double by_point[2][3]) {
    const double x = point_mm[0], y = point_mm[1], z = point_mm[2];
    const double across2 = x * x + y * y, range2 = across2 + z * z;
    // Angle per mm across, and what it gains along the direction across.
    const double across = std::sqrt(across2);
    const double per_mm = across > 0 ? std::atan2(across, z) / across : 1 / z;
    const double gain =
        across2 > 1e-12 * range2 ? (z / range2 - per_mm) / across2 : -2.0 / 3 / (z * z * z);
    by_point[0][0] = focal_px * (per_mm + gain * x * x);
    by_point[0][1] = by_point[1][0] = focal_px * gain * x * y;
    by_point[1][1] = focal_px * (per_mm + gain * y * y);
    by_point[0][2] = -focal_px * x / range2;
    by_point[1][2] = -focal_px * y / range2;
}

// Derivatives of a pixel's axis by the point, from those by the ideal position.
void chain_point(const lens_frame &frame, const lens_state &lens, double focal_px,
                 const double point_mm[3], const ideal_point &at, double by_u, double by_v,
                 double by_point[3]) {
    if (lens.kind != LENS_EQUIDISTANT) {
        const double inverse_z = 1 / point_mm[2];
        by_point[0] = by_u * focal_px * inverse_z;
        by_point[1] = by_v * focal_px * inverse_z;
        by_point[2] = -(by_u * at.s + by_v * at.t) * frame.radius_px * inverse_z;
        return;
    }
    double by_ideal[2][3];
    angle_slope(focal_px, point_mm, by_ideal);
    for (int i = 0; i < 3; i++) {
        by_point[i] = by_u * by_ideal[0][i] + by_v * by_ideal[1][i];
    }
}

// Derivatives of `distort` by the ideal position in px: {{d[0], d[1]}, {d[1], d[2]}}.
void distortion_slope(const lens_frame &frame, const lens_state &lens, const ideal_point &at,
                      double slope[3]) {
    const auto &q = lens.value;
    const double inverse = 1 / frame.radius_px;
    const radial_part part = radial_at(lens, frame.radius_px, at.rho2);
    const double radial = part.factor;
    const double last =
        lens.kind == LENS_EQUIDISTANT ? 3 * q[RADIAL_6] + at.rho2 * 4 * q[K4] : 3 * q[RADIAL_6];
    double turn = 2 * inverse * (q[RADIAL_2] + at.rho2 * (2 * q[RADIAL_4] + at.rho2 * last));
    if (lens.kind == LENS_RATIONAL) {
        const double below = 2 * inverse * (q[K4] + at.rho2 * (2 * q[K5] + at.rho2 * 3 * q[K6]));
        turn = (turn - radial * below) / part.below;
    }
    const double p1 = q[TANGENTIAL_1] * inverse, p2 = q[TANGENTIAL_2] * inverse;
    slope[0] = radial + turn * at.s * at.s + 2 * p1 * at.t + 6 * p2 * at.s;
    slope[1] = turn * at.s * at.t + 2 * p1 * at.s + 2 * p2 * at.t;
    slope[2] = radial + turn * at.t * at.t + 6 * p1 * at.t + 2 * p2 * at.s;
}

// Effects of the coefficients on one axis; `along` is the ideal position on it.
void coefficient_slopes(const lens_state &lens, const radial_part &part, const ideal_point &at,
                        double along, double *by_lens) {
    const double rho2 = at.rho2, rho6 = rho2 * rho2 * rho2;
    const double above = along / part.below;
    by_lens[RADIAL_2] = above * rho2;
    by_lens[RADIAL_4] = above * rho2 * rho2;
    by_lens[RADIAL_6] = above * rho2 * rho2 * rho2;
    by_lens[K4] = by_lens[K5] = by_lens[K6] = 0;
    if (lens.kind == LENS_EQUIDISTANT) {
        by_lens[K4] = along * rho6 * rho2;
    } else if (lens.kind == LENS_RATIONAL) {
        by_lens[K4] = -above * part.factor * rho2;
        by_lens[K5] = -above * part.factor * rho2 * rho2;
        by_lens[K6] = -above * part.factor * rho6;
    }
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
    const double inverse = result.fx_px / frame.radius_px;  // inverse of the ideal reference radius
    const double square = inverse * inverse;
    result.k1 = q[RADIAL_2] / frame.radius_px * square;
    result.k2 = q[RADIAL_4] / frame.radius_px * square * square;
    result.k3 = q[RADIAL_6] / frame.radius_px * square * square * square;
    result.p1 = q[TANGENTIAL_1] / frame.radius_px * inverse;
    result.p2 = q[TANGENTIAL_2] / frame.radius_px * inverse;
    result.kind = state.kind;
    if (state.kind == LENS_EQUIDISTANT) {
        result.k4 = q[K4] / frame.radius_px * square * square * square * square;
    } else if (state.kind == LENS_RATIONAL) {
        result.k4 = q[K4] / frame.radius_px * square;
        result.k5 = q[K5] / frame.radius_px * square * square;
        result.k6 = q[K6] / frame.radius_px * square * square * square;
    }
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
    state.kind = lens.kind;
    if (lens.kind == LENS_EQUIDISTANT) {
        q[K4] = lens.k4 * frame.radius_px * square * square * square * square;
    } else if (lens.kind == LENS_RATIONAL) {
        q[K4] = lens.k4 * frame.radius_px * square;
        q[K5] = lens.k5 * frame.radius_px * square * square;
        q[K6] = lens.k6 * frame.radius_px * square * square * square;
    }
    return state;
}

namespace {

// Radii of one ray in focal lengths: as the kind counts them, and in the image.
struct radius_pair {
    double ideal, seen;
};

// From the centre to the corner, as far as the lens sees, within 80 degrees of its axis.
std::vector<radius_pair> radii_of(const lens_frame &frame, lens lens, lens_kind kind) {
    const double tangent_max = std::tan(80 * MATH_RAD_PER_DEGREE);
    const int steps = 200;
    std::vector<radius_pair> radii;
    lens.p1 = lens.p2 = 0;
    for (int i = 1; i <= steps; i++) {
        const double seen_px = frame.radius_px * i / steps;
        const double pixel_px[2] = {lens.cx_px + seen_px, lens.cy_px};
        double ray[3];
        if (!lens_ray(&lens, pixel_px, ray) || !(ray[0] <= tangent_max * ray[2])) {
            break;
        }
        const double tangent = ray[0] / ray[2];
        radii.push_back(
            {kind == LENS_EQUIDISTANT ? std::atan(tangent) : tangent, seen_px / lens.fx_px});
    }
    return radii;
}

int count_radial(lens_kind kind) {
    if (kind == LENS_RATIONAL) {
        return 6;
    }
    return kind == LENS_EQUIDISTANT ? 4 : 3;
}

// Coefficients of r (1 + k1 r^2 + k2 r^4 + ...) - seen (k4 r^2 + k5 r^4 + k6 r^6) = seen, the
// latter part for a rational lens only: linear in them. Radii are scaled to the largest one.
vector fit_radii(const std::vector<radius_pair> &radii, lens_kind kind) {
    const bool rational = kind == LENS_RATIONAL;
    const int count = count_radial(kind);
    if (long(radii.size()) <= count) {
        return vector::Zero(count);
    }
    const double largest = radii.back().ideal;
    matrix A(long(radii.size()), count);
    vector b(long(radii.size()));
    for (long i = 0; i < A.rows(); i++) {
        const radius_pair &one = radii[size_t(i)];
        const double u = one.ideal * one.ideal / (largest * largest);
        for (int k = 0; k < count; k++) {
            A(i, k) = rational && k >= 3 ? -one.seen * std::pow(u, k - 2)
                                         : one.ideal * std::pow(u, k + 1);
        }
        b(i) = one.seen - one.ideal;
    }
    vector k = solve_symmetric(product(A.transpose(), A), product(A.transpose(), b));
    for (int i = 0; i < count; i++) {
        k[i] /= std::pow(largest, 2 * (rational && i >= 3 ? i - 2 : i + 1));
    }
    return k;
}

}  // namespace

lens_state converted(const lens_frame &frame, const lens_state &state, lens_kind kind) {
    lens_state same = state;
    same.kind = kind;
    if (state.kind == kind || (state.kind == LENS_BROWN_CONRADY && kind == LENS_RATIONAL)) {
        return same;
    }
    lens to = lens_from_state(frame, state);
    const vector k = fit_radii(radii_of(frame, to, kind), kind);
    to.kind = kind;
    to.k1 = k[0];
    to.k2 = k[1];
    to.k3 = k[2];
    to.k4 = kind == LENS_BROWN_CONRADY ? 0 : k[3];
    to.k5 = kind == LENS_RATIONAL ? k[4] : 0;
    to.k6 = kind == LENS_RATIONAL ? k[5] : 0;
    to.p1 = kind == LENS_EQUIDISTANT ? 0 : to.p1;
    to.p2 = kind == LENS_EQUIDISTANT ? 0 : to.p2;
    return state_from_lens(frame, to);
}

bool project(const lens_frame &frame, const lens_state &state, const double point_mm[3],
             double pixel_px[2]) {
    const auto &q = state.value;
    double moved[2];
    ideal_point at;
    if (!ideal_of(frame, state, std::exp(q[LOG_FOCAL]), point_mm, &at) ||
        !distort(frame, state, at, moved)) {
        return false;
    }
    pixel_px[0] = frame.middle_x_px + q[CENTRE_X] + moved[0];
    pixel_px[1] = frame.middle_y_px + q[CENTRE_Y] + std::exp(q[LOG_ASPECT]) * moved[1];
    return true;
}

bool project(const lens_frame &frame, const lens_state &state, const double point_mm[3],
             projection *result) {
    const auto &q = state.value;
    const double focal = std::exp(q[LOG_FOCAL]), aspect = std::exp(q[LOG_ASPECT]);
    ideal_point at;
    double moved[2], slope[3];
    if (!ideal_of(frame, state, focal, point_mm, &at) || !distort(frame, state, at, moved)) {
        return false;
    }
    distortion_slope(frame, state, at, slope);
    const radial_part part = radial_at(state, frame.radius_px, at.rho2);
    const bool plane = state.kind != LENS_EQUIDISTANT;
    const double s = at.s, t = at.t, rho2 = at.rho2, radius = frame.radius_px;

    result->pixel_px[0] = frame.middle_x_px + q[CENTRE_X] + moved[0];
    result->pixel_px[1] = frame.middle_y_px + q[CENTRE_Y] + aspect * moved[1];
    for (int axis = 0; axis < 2; axis++) {
        const double stretch = axis == 0 ? 1 : aspect;
        const double by_u = stretch * slope[axis], by_v = stretch * slope[axis + 1];
        double *by_lens = result->by_lens[axis];
        chain_point(frame, state, focal, point_mm, at, by_u, by_v, result->by_point[axis]);
        by_lens[LOG_FOCAL] = (by_u * s + by_v * t) * radius;
        by_lens[LOG_ASPECT] = axis == 0 ? 0 : aspect * moved[1];
        by_lens[CENTRE_X] = axis == 0;
        by_lens[CENTRE_Y] = axis == 1;
        coefficient_slopes(state, part, at, stretch * (axis == 0 ? s : t), by_lens);
        by_lens[TANGENTIAL_1] = plane * stretch * (axis == 0 ? 2 * s * t : rho2 + 2 * t * t);
        by_lens[TANGENTIAL_2] = plane * stretch * (axis == 0 ? rho2 + 2 * s * s : 2 * s * t);
    }
    return true;
}

lens_kind lens_model::lens() const {
    if (distortion == RATIONAL) {
        return LENS_RATIONAL;
    }
    return distortion == EQUIDISTANT ? LENS_EQUIDISTANT : LENS_BROWN_CONRADY;
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
            return distortion >= K1_K2_P1_P2 && distortion != EQUIDISTANT;
        case RADIAL_6:
            return distortion >= K1_K2_P1_P2_K3;
        case K4:
            return distortion >= RATIONAL;
        case K5:
            return distortion == RATIONAL;
        case K6:  // few views determine k6 together with k3
            return false;
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
         "k1 k2 p1 p2 k3, free fy", "rational, free fy", "equidistant, free fy"},
        {"no distortion", "k1", "k1 k2", "k1 k2 p1 p2", "k1 k2 p1 p2 k3", "rational",
         "equidistant"}};
    return names[model.square_pixels][model.distortion];
}

const char *board_model_name(board_model model) {
    static const char *const names[2][2] = {{"flat", "flat, print stretched"},
                                            {"bent", "bent, print stretched"}};
    return names[model.bent][model.stretched];
}

}  // namespace calib

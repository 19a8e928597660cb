// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/lens.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"

// Squared radius limit of any camera's view (89.9 degrees off the axis).
static const double RADIUS2_MAX = 1e6;

bool lens_is_ideal(const struct lens *lens) {
    return lens->k1 == 0 && lens->k2 == 0 && lens->p1 == 0 && lens->p2 == 0 && lens->k3 == 0;
}

void lens_distort(const struct lens *lens, const double ideal[2], double distorted[2]) {
    const double x = ideal[0], y = ideal[1];
    const double r2 = x * x + y * y;
    const double radial = 1.0 + r2 * (lens->k1 + r2 * (lens->k2 + r2 * lens->k3));
    distorted[0] = x * radial + 2.0 * lens->p1 * x * y + lens->p2 * (r2 + 2.0 * x * x);
    distorted[1] = y * radial + lens->p1 * (r2 + 2.0 * y * y) + 2.0 * lens->p2 * x * y;
}

void lens_distort_slope(const struct lens *lens, const double ideal[2], double slope[4]) {
    const double x = ideal[0], y = ideal[1];
    const double r2 = x * x + y * y;
    const double radial = 1.0 + r2 * (lens->k1 + r2 * (lens->k2 + r2 * lens->k3));
    const double change = 2.0 * (lens->k1 + r2 * (2.0 * lens->k2 + r2 * 3.0 * lens->k3));
    slope[0] = radial + change * x * x + 2.0 * lens->p1 * y + 6.0 * lens->p2 * x;
    slope[1] = change * x * y + 2.0 * lens->p1 * x + 2.0 * lens->p2 * y;
    slope[2] = slope[1];
    slope[3] = radial + change * y * y + 6.0 * lens->p1 * y + 2.0 * lens->p2 * x;
}

// Derivative of the radial mapping r (1 + k1 r^2 + k2 r^4 + k3 r^6) at r^2 = u.
static double radial_slope(const struct lens *lens, double u) {
    return 1.0 + u * (3.0 * lens->k1 + u * (5.0 * lens->k2 + u * 7.0 * lens->k3));
}

// Zeros of the derivative of `radial_slope` at u > 0, ascending; returns their number (0..2).
static int radial_turns(const struct lens *lens, double turns[2]) {
    const double a = 21.0 * lens->k3, b = 10.0 * lens->k2, c = 3.0 * lens->k1;
    double root[2];
    int roots = 0;
    if (a == 0) {
        if (b != 0) {
            root[roots++] = -c / b;
        }
    } else {
        const double discriminant = b * b - 4.0 * a * c;
        if (discriminant >= 0) {
            const double q = -0.5 * (b + (b < 0 ? -sqrt(discriminant) : sqrt(discriminant)));
            root[roots++] = q / a;
            if (q != 0) {
                root[roots++] = c / q;
            }
        }
    }
    INVARIANT(roots <= 2);
    int count = 0;
    for (int i = 0; i < roots; i++) {
        if (root[i] > 0) {
            turns[count++] = root[i];
        }
    }
    if (count == 2 && turns[0] > turns[1]) {
        const double larger = turns[0];
        turns[0] = turns[1];
        turns[1] = larger;
    }
    return count;
}

// Whether the radial mapping is increasing from the centre to r^2 = u.
static bool grows_up_to(const struct lens *lens, double u) {
    double turns[2];
    const int count = radial_turns(lens, turns);
    for (int i = 0; i < count; i++) {
        if (turns[i] < u && !(radial_slope(lens, turns[i]) > 0)) {
            return false;
        }
    }
    return u <= RADIUS2_MAX && radial_slope(lens, u) > 0;
}

double lens_fold_radius(const struct lens *lens) {
    double ends[3];
    int count = radial_turns(lens, ends);
    ends[count++] = RADIUS2_MAX;
    double low = 0;
    for (int i = 0; i < count && low < RADIUS2_MAX; i++) {
        double high = ends[i] < RADIUS2_MAX ? ends[i] : RADIUS2_MAX;
        if (radial_slope(lens, high) > 0) {  // no zero up to here: monotone between extrema
            low = high;
            continue;
        }
        while (high - low > 1e-14 * high) {
            const double middle = 0.5 * (low + high);
            if (middle <= low || middle >= high) {
                break;
            }
            if (radial_slope(lens, middle) > 0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        INVARIANT(low >= 0 && low <= RADIUS2_MAX);
        return sqrt(low);
    }
    return INFINITY;
}

// Whether the Jacobian is positive definite on the whole circle of radius r. With t = 2 r |(p1,
// p2)| and c, s the cosine and sine of the angle from (p2, p1) it reads, along and across the
// radius, {{along + 3 t c, t s}, {t s, across + t c}}.
static bool is_definite(const struct lens *lens, double r) {
    const double u = r * r;
    const double along = radial_slope(lens, u);
    const double across = 1.0 + u * (lens->k1 + u * (lens->k2 + u * lens->k3));
    if (!(along > 0 && across > 0)) {
        return false;
    }
    const double t = 2.0 * r * sqrt(lens->p1 * lens->p1 + lens->p2 * lens->p2);
    const double sum = along + 3.0 * across;
    // The determinant 4 t^2 c^2 + t sum c + along across - t^2 is lowest at this t c.
    const double lowest = sum < 8.0 * t ? -sum / 8.0 : -t;
    return lowest * (4.0 * lowest + sum) + along * across - t * t > 0;
}

double lens_view_radius(const struct lens *lens) {
    static const double share = 0.98, first = 1e-6, growth = 1.02;
    const double fold = lens_fold_radius(lens);
    if (lens->p1 == 0 && lens->p2 == 0) {
        return share * fold;
    }
    const double end = fold < RADIUS2_MAX ? fold : sqrt(RADIUS2_MAX);
    double low = 0, high = first < end ? first : end;
    while (is_definite(lens, high)) {
        if (high >= end) {
            return share * fold;
        }
        low = high;
        high = growth * high < end ? growth * high : end;
    }
    while (high - low > 1e-9 * high) {
        const double middle = 0.5 * (low + high);
        if (is_definite(lens, middle)) {
            low = middle;
        } else {
            high = middle;
        }
    }
    INVARIANT(low >= 0 && low < fold);
    return share * low;
}

static double norm2(const double a[2]) {
    return a[0] * a[0] + a[1] * a[1];
}

// Residual of `ideal` as the inverse of `distorted`.
static double residual(const struct lens *lens, const double ideal[2], const double distorted[2],
                       double rest[2]) {
    double there[2];
    lens_distort(lens, ideal, there);
    rest[0] = distorted[0] - there[0];
    rest[1] = distorted[1] - there[1];
    return sqrt(norm2(rest));
}

// One Newton step, shortened until it stays before the fold and reduces the residual. Returns false
// if no step does.
static bool newton_step(const struct lens *lens, const double distorted[2], double ideal[2],
                        double rest[2], double *error) {
    double J[4];
    lens_distort_slope(lens, ideal, J);
    const double determinant = J[0] * J[3] - J[1] * J[2];
    if (!(determinant > 0)) {
        return false;
    }
    const double step[2] = {(J[3] * rest[0] - J[1] * rest[1]) / determinant,
                            (J[0] * rest[1] - J[2] * rest[0]) / determinant};
    for (double share = 1.0; share > 1e-6; share *= 0.5) {
        const double next[2] = {ideal[0] + share * step[0], ideal[1] + share * step[1]};
        double next_rest[2];
        const double next_error = residual(lens, next, distorted, next_rest);
        if (next_error < *error && grows_up_to(lens, norm2(next))) {
            for (int i = 0; i < 2; i++) {
                ideal[i] = next[i];
                rest[i] = next_rest[i];
            }
            INVARIANT(next_error >= 0);
            *error = next_error;
            return true;
        }
    }
    return false;
}

bool lens_undistort(const struct lens *lens, const double distorted[2], double ideal[2]) {
    const double size2 = norm2(distorted);
    if (!(size2 <= RADIUS2_MAX)) {  // also rejects a NaN
        return false;
    }
    if (lens_is_ideal(lens)) {
        ideal[0] = distorted[0];
        ideal[1] = distorted[1];
        return true;
    }
    double guess[2] = {distorted[0], distorted[1]};
    for (int i = 0; i < 60 && !grows_up_to(lens, norm2(guess)); i++) {
        guess[0] *= 0.5;
        guess[1] *= 0.5;
    }
    double rest[2];
    double error = residual(lens, guess, distorted, rest);
    for (int i = 0; i < 50 && error > 0 && newton_step(lens, distorted, guess, rest, &error); i++) {
    }
    // After Newton's last step only rounding errors remain, unless there is no solution.
    if (!(error <= 1e-12 * (1.0 + sqrt(size2)))) {
        return false;
    }
    double J[4];
    lens_distort_slope(lens, guess, J);
    if (!(J[0] * J[3] - J[1] * J[2] > 0) || !grows_up_to(lens, norm2(guess))) {
        return false;
    }
    INVARIANT(norm2(guess) <= RADIUS2_MAX);
    ideal[0] = guess[0];
    ideal[1] = guess[1];
    return true;
}

bool lens_project(const struct lens *lens, const double point_mm[3], double pixel_px[2]) {
    if (!(point_mm[2] > 0)) {
        return false;
    }
    const double ideal[2] = {point_mm[0] / point_mm[2], point_mm[1] / point_mm[2]};
    double distorted[2];
    lens_distort(lens, ideal, distorted);
    pixel_px[0] = lens->fx_px * distorted[0] + lens->cx_px;
    pixel_px[1] = lens->fy_px * distorted[1] + lens->cy_px;
    return true;
}

bool lens_ray(const struct lens *lens, const double pixel_px[2], double direction[3]) {
    const double distorted[2] = {(pixel_px[0] - lens->cx_px) / lens->fx_px,
                                 (pixel_px[1] - lens->cy_px) / lens->fy_px};
    double ideal[2];
    if (!lens_undistort(lens, distorted, ideal)) {
        return false;
    }
    direction[0] = ideal[0];
    direction[1] = ideal[1];
    direction[2] = 1.0;
    return true;
}

static bool within(double value, double low, double high) {
    return value >= low && value <= high;
}

// The border of the central half is sufficient: the image of the view, a disc that is mapped one to
// one, has no holes.
static bool sees_central_half(const struct lens *lens) {
    enum { STEPS = 16 };
    const double radius = lens_view_radius(lens);
    for (int i = 0; i < 4 * STEPS; i++) {
        const double way = 0.25 + 0.5 * (i % STEPS) / STEPS, back = 1.0 - way;
        const double share[4][2] = {{way, 0.25}, {0.75, way}, {back, 0.75}, {0.25, back}};
        const double pixel_px[2] = {(lens->width_px - 1) * share[i / STEPS][0],
                                    (lens->height_px - 1) * share[i / STEPS][1]};
        double direction[3];
        INVARIANT(lens->fx_px > 0 && lens->fy_px > 0);
        if (!lens_ray(lens, pixel_px, direction) || sqrt(norm2(direction)) > radius) {
            return false;
        }
    }
    return true;
}

int lens_validate(const struct lens *lens) {
    if (lens->width_px < 1 || lens->height_px < 1) {
        return ERROR_RANGE;
    }
    if (lens->width_px > LENS_SIDE_MAX_PX || lens->height_px > LENS_SIDE_MAX_PX) {
        return ERROR_TOO_LARGE;
    }
    const double k[5] = {lens->k1, lens->k2, lens->p1, lens->p2, lens->k3};
    for (int i = 0; i < 5; i++) {
        if (!within(k[i], -LENS_COEFFICIENT_MAX, LENS_COEFFICIENT_MAX)) {
            return ERROR_RANGE;
        }
    }
    if (!within(lens->fx_px, LENS_FOCAL_MIN_PX, LENS_FOCAL_MAX_PX) ||
        !within(lens->fy_px, LENS_FOCAL_MIN_PX, LENS_FOCAL_MAX_PX) ||
        !within(lens->cx_px, -LENS_CENTRE_MAX_PX, LENS_CENTRE_MAX_PX) ||
        !within(lens->cy_px, -LENS_CENTRE_MAX_PX, LENS_CENTRE_MAX_PX)) {
        return ERROR_RANGE;
    }
    return sees_central_half(lens) ? ERROR_OK : ERROR_DISTORTION;
}

// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/lens.h"

#include <math.h>
#include <stddef.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/lens_fold.h"

// Squared radius limit of any camera's view (89.9 degrees off the axis).
static const double RADIUS2_MAX = 1e6;

// 89.9 degrees: an equidistant lens has no ideal coordinates beyond.
static const double COSINE_MIN = 1e-3;

const char *lens_kind_name(enum lens_kind kind) {
    static const char *const names[LENS_KINDS] = {"brown-conrady", "rational", "equidistant"};
    INVARIANT((int)kind >= 0 && kind < LENS_KINDS);
    return names[kind];
}

bool lens_is_ideal(const struct lens *lens) {
    return lens->kind != LENS_EQUIDISTANT && lens->k1 == 0 && lens->k2 == 0 && lens->p1 == 0 &&
           lens->p2 == 0 && lens->k3 == 0 && lens->k4 == 0 && lens->k5 == 0 && lens->k6 == 0;
}

static double norm2(const double a[2]) {
    return a[0] * a[0] + a[1] * a[1];
}

// 1 + k1 u + k2 u^2 + k3 u^3.
static double cubic(double k1, double k2, double k3, double u) {
    return 1.0 + u * (k1 + u * (k2 + u * k3));
}

static double cubic_slope(double k1, double k2, double k3, double u) {
    return k1 + u * (2.0 * k2 + u * 3.0 * k3);
}

// Radius in the image of an equidistant lens, over the angle, at angle^2 = u.
static double angle_factor(const struct lens *lens, double u) {
    return 1.0 + u * (lens->k1 + u * (lens->k2 + u * (lens->k3 + u * lens->k4)));
}

// Derivative of the radius in the image by the angle.
static double angle_slope(const struct lens *lens, double u) {
    return 1.0 +
           u * (3.0 * lens->k1 + u * (5.0 * lens->k2 + u * (7.0 * lens->k3 + u * 9.0 * lens->k4)));
}

// The radial factor at r^2 = u. `change`, unless NULL, receives twice its derivative by u.
static double radial_factor(const struct lens *lens, double u, double *change) {
    INVARIANT(lens->kind < LENS_KINDS);
    if (lens->kind == LENS_EQUIDISTANT && u < 1e-8) {  // the next terms are below the last digit
        const double slope = lens->k1 - 1.0 / 3.0;
        if (change != NULL) {
            *change = 2.0 * slope;
        }
        return 1.0 + u * slope;
    }
    if (lens->kind == LENS_EQUIDISTANT) {
        const double r = sqrt(u), angle = math_atan2(r, 1.0);
        const double factor = angle * angle_factor(lens, angle * angle) / r;
        if (change != NULL) {
            *change = (angle_slope(lens, angle * angle) / (1.0 + u) - factor) / u;
        }
        return factor;
    }
    const double above = cubic(lens->k1, lens->k2, lens->k3, u);
    const bool divided = lens->kind == LENS_RATIONAL;
    const double below = divided ? cubic(lens->k4, lens->k5, lens->k6, u) : 1.0;
    const double factor = divided ? above / below : above;
    if (change != NULL) {
        const double slope = cubic_slope(lens->k1, lens->k2, lens->k3, u);
        *change = 2.0 * slope;
        if (divided) {
            const double below_slope = cubic_slope(lens->k4, lens->k5, lens->k6, u);
            *change = 2.0 * (slope - factor * below_slope) / below;
        }
    }
    return factor;
}

void lens_distort(const struct lens *lens, const double ideal[2], double distorted[2]) {
    const double x = ideal[0], y = ideal[1];
    const double r2 = x * x + y * y;
    const double radial = radial_factor(lens, r2, NULL);
    distorted[0] = x * radial + 2.0 * lens->p1 * x * y + lens->p2 * (r2 + 2.0 * x * x);
    distorted[1] = y * radial + lens->p1 * (r2 + 2.0 * y * y) + 2.0 * lens->p2 * x * y;
}

void lens_distort_slope(const struct lens *lens, const double ideal[2], double slope[4]) {
    const double x = ideal[0], y = ideal[1];
    double change;
    const double radial = radial_factor(lens, x * x + y * y, &change);
    slope[0] = radial + change * x * x + 2.0 * lens->p1 * y + 6.0 * lens->p2 * x;
    slope[1] = change * x * y + 2.0 * lens->p1 * x + 2.0 * lens->p2 * y;
    slope[2] = slope[1];
    slope[3] = radial + change * y * y + 6.0 * lens->p1 * y + 2.0 * lens->p2 * x;
}

static struct lens_fold_growth growth_of(const struct lens *lens) {
    struct lens_fold_growth result = {
        {3, {1.0, 3.0 * lens->k1, 5.0 * lens->k2, 7.0 * lens->k3}},
        {0, {1.0}},
    };
    if (lens->kind == LENS_EQUIDISTANT) {
        result.slope = (struct lens_fold_polynomial){
            4, {1.0, 3.0 * lens->k1, 5.0 * lens->k2, 7.0 * lens->k3, 9.0 * lens->k4}};
    }
    if (lens->kind == LENS_RATIONAL) {  // (r a / b)' b^2 = a b + 2 r^2 (a' b - a b')
        const double a[4] = {1.0, lens->k1, lens->k2, lens->k3};
        const double b[4] = {1.0, lens->k4, lens->k5, lens->k6};
        result.slope = (struct lens_fold_polynomial){6, {0}};
        for (int i = 0; i < 4; i++) {
            for (int j = 0; j < 4; j++) {
                result.slope.c[i + j] += a[i] * b[j] * (1 + 2 * (i - j));
            }
        }
        result.below = (struct lens_fold_polynomial){3, {1.0, lens->k4, lens->k5, lens->k6}};
    }
    return result;
}

// Where a lens may be inverted. The fold is found when it is needed first.
struct domain {
    struct lens_fold_growth growth;
    double fold2;  // negative: not known yet
};

// Whether the radial mapping grows from the centre to r^2 = u.
static bool grows_up_to(struct domain *domain, double u) {
    if (lens_fold_is_safe(&domain->growth, u)) {
        return u <= RADIUS2_MAX;
    }
    if (domain->fold2 < 0) {
        domain->fold2 = lens_fold_first(&domain->growth, RADIUS2_MAX);
    }
    return u <= RADIUS2_MAX && u < domain->fold2;
}

double lens_fold_angle(const struct lens *lens) {
    INVARIANT(lens->kind == LENS_EQUIDISTANT);
    const struct lens_fold_growth growth = growth_of(lens);
    const double fold2 = lens_fold_first(&growth, MATH_PI * MATH_PI);
    return fold2 < INFINITY ? sqrt(fold2) : MATH_PI;
}

// The radius of ideal coordinates that belongs to an angle off the axis.
static double radius_of_angle(double angle) {
    const double cosine = math_cos(angle);
    return cosine > COSINE_MIN ? math_sin(angle) / cosine : INFINITY;
}

double lens_fold_radius(const struct lens *lens) {
    if (lens->kind == LENS_EQUIDISTANT) {
        return radius_of_angle(lens_fold_angle(lens));
    }
    const struct lens_fold_growth growth = growth_of(lens);
    return sqrt(lens_fold_first(&growth, RADIUS2_MAX));
}

static double tangential_norm(const struct lens *lens) {
    return sqrt(lens->p1 * lens->p1 + lens->p2 * lens->p2);
}

// Whether the Jacobian is positive definite on the whole circle of radius r. With t = 2 r
// `tangential` = 2 r |(p1, p2)| and c, s the cosine and sine of the angle from (p2, p1) it reads,
// along and across the radius, {{along + 3 t c, t s}, {t s, across + t c}}.
static bool is_definite(const struct lens *lens, double tangential, double r) {
    const double u = r * r;
    double change;
    const double across = radial_factor(lens, u, &change);
    const double along = across + u * change;
    if (!(along > 0 && across > 0)) {
        return false;
    }
    const double t = 2.0 * r * tangential;
    const double sum = along + 3.0 * across;
    // The determinant 4 t^2 c^2 + t sum c + along across - t^2 is lowest at this t c.
    const double lowest = sum < 8.0 * t ? -sum / 8.0 : -t;
    return lowest * (4.0 * lowest + sum) + along * across - t * t > 0;
}

// A radius up to which no sign of the coefficients makes the Jacobian indefinite: by Gershgorin's
// circles it is definite where along and across exceed 4 t.
static double surely_definite_radius(const struct lens *lens, double tangential, double end) {
    if (lens->kind != LENS_BROWN_CONRADY) {
        return 0;
    }
    const double slope[3] = {3.0 * lens->k1, 5.0 * lens->k2, 7.0 * lens->k3};
    for (double r = end; r > 1e-6; r *= 0.5) {
        double sum = 0;
        for (int i = 2; i >= 0; i--) {
            sum = (sum + math_max(slope[i], -slope[i])) * r * r;
        }
        if (sum + 8.0 * tangential * r < 0.99) {
            return r;
        }
    }
    return 0;
}

// Of the disc on which the mapping is one to one, the part that counts as the view.
static const double VIEW_SHARE = 0.98;

static double angle_view_radius(const struct lens *lens) {
    const double fold_angle = lens_fold_angle(lens);
    return fold_angle < MATH_PI ? radius_of_angle(VIEW_SHARE * fold_angle) : INFINITY;
}

double lens_view_radius(const struct lens *lens) {
    static const double first = 1e-6, growth = 1.02;
    if (lens->kind == LENS_EQUIDISTANT) {
        return angle_view_radius(lens);
    }
    const double fold = lens_fold_radius(lens);
    if (lens->p1 == 0 && lens->p2 == 0) {
        return VIEW_SHARE * fold;
    }
    const double end = fold < RADIUS2_MAX ? fold : sqrt(RADIUS2_MAX);
    const double tangential = tangential_norm(lens);
    const double sure = surely_definite_radius(lens, tangential, end);
    double low = 0, high = math_min(first, end);
    while (high <= sure || is_definite(lens, tangential, high)) {
        if (high >= end) {
            return VIEW_SHARE * fold;
        }
        low = high;
        high = math_min(growth * high, end);
    }
    while (high - low > 1e-9 * high) {
        const double middle = 0.5 * (low + high);
        if (is_definite(lens, tangential, middle)) {
            low = middle;
        } else {
            high = middle;
        }
    }
    INVARIANT(low >= 0 && low < fold);
    return VIEW_SHARE * low;
}

bool lens_sees(double view_radius, const double direction[3]) {
    return view_radius == INFINITY ||
           (direction[2] > 0 && sqrt(norm2(direction)) <= view_radius * direction[2]);
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

static double jacobian(const struct lens *lens, const double ideal[2], double J[4]) {
    lens_distort_slope(lens, ideal, J);
    return J[0] * J[3] - J[1] * J[2];
}

// One Newton step, shortened until it stays before the fold and reduces the residual. Returns false
// if no step does; the Jacobian's determinant is that before the step.
static bool newton_step(const struct lens *lens, struct domain *domain, const double distorted[2],
                        double ideal[2], double rest[2], double *error, double *determinant) {
    double J[4];
    *determinant = jacobian(lens, ideal, J);
    if (!(*determinant > 0)) {
        return false;
    }
    const double step[2] = {(J[3] * rest[0] - J[1] * rest[1]) / *determinant,
                            (J[0] * rest[1] - J[2] * rest[0]) / *determinant};
    for (double share = 1.0; share > 1e-6; share *= 0.5) {
        const double next[2] = {ideal[0] + share * step[0], ideal[1] + share * step[1]};
        if (next[0] == ideal[0] && next[1] == ideal[1]) {
            return false;  // nor will a shorter step change it
        }
        double next_rest[2];
        const double next_error = residual(lens, next, distorted, next_rest);
        if (next_error < *error && grows_up_to(domain, norm2(next))) {
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

// Newton's method on the plane, for a lens that is not equidistant.
static bool undistort_plane(const struct lens *lens, const double distorted[2], double ideal[2]) {
    struct domain domain = {growth_of(lens), -1};
    double guess[2] = {distorted[0], distorted[1]};
    for (int i = 0; i < 60 && !grows_up_to(&domain, norm2(guess)); i++) {
        guess[0] *= 0.5;
        guess[1] *= 0.5;
    }
    double rest[2];
    double error = residual(lens, guess, distorted, rest), determinant = 0;
    bool settled = false;
    for (int i = 0; i < 50 && error > 0 && !settled; i++) {
        settled = !newton_step(lens, &domain, distorted, guess, rest, &error, &determinant);
    }
    // After Newton's last step only rounding errors remain, unless there is no solution.
    if (!(error <= 1e-12 * (1.0 + sqrt(norm2(distorted))))) {
        return false;
    }
    double J[4];
    determinant = settled ? determinant : jacobian(lens, guess, J);
    if (!(determinant > 0) || !grows_up_to(&domain, norm2(guess))) {
        return false;
    }
    INVARIANT(norm2(guess) <= RADIUS2_MAX);
    ideal[0] = guess[0];
    ideal[1] = guess[1];
    return true;
}

// Angle off the axis at which an equidistant lens has a radius in the image. Newton's method, kept
// between the ends of an interval that shrinks around the solution, converges before every fold.
static bool find_angle(const struct lens *lens, double radius, double *angle) {
    double low = 0, high = lens_fold_angle(lens);
    if (!(radius <= high * angle_factor(lens, high * high))) {
        return false;
    }
    double at = radius < high ? radius : 0.5 * high;
    for (int i = 0; i < 100; i++) {
        const double rest = at * angle_factor(lens, at * at) - radius;
        low = rest <= 0 ? at : low;
        high = rest >= 0 ? at : high;
        const double newton = at - rest / angle_slope(lens, at * at);
        const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
        if (rest == 0 || !(next > low && next < high)) {
            break;
        }
        at = next;
    }
    INVARIANT(at >= 0 && at <= MATH_PI);
    *angle = at;
    return true;
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
    if (lens->kind != LENS_EQUIDISTANT) {
        return undistort_plane(lens, distorted, ideal);
    }
    double angle;
    if (!find_angle(lens, sqrt(size2), &angle) || !(radius_of_angle(angle) < INFINITY)) {
        return false;
    }
    const double scale = size2 > 0 ? radius_of_angle(angle) / sqrt(size2) : 1.0;
    ideal[0] = scale * distorted[0];
    ideal[1] = scale * distorted[1];
    return true;
}

bool lens_project(const struct lens *lens, const double point_mm[3], double pixel_px[2]) {
    double distorted[2];
    if (lens->kind == LENS_EQUIDISTANT && !(point_mm[2] > 0)) {
        const double r = sqrt(norm2(point_mm));
        if (!(r > 0)) {
            return false;
        }
        const double angle = math_atan2(r, point_mm[2]);
        const double scale = angle * angle_factor(lens, angle * angle) / r;
        distorted[0] = scale * point_mm[0];
        distorted[1] = scale * point_mm[1];
    } else if (point_mm[2] > 0) {
        const double ideal[2] = {point_mm[0] / point_mm[2], point_mm[1] / point_mm[2]};
        lens_distort(lens, ideal, distorted);
    } else {
        return false;
    }
    pixel_px[0] = lens->fx_px * distorted[0] + lens->cx_px;
    pixel_px[1] = lens->fy_px * distorted[1] + lens->cy_px;
    return true;
}

bool lens_ray(const struct lens *lens, const double pixel_px[2], double direction[3]) {
    const double distorted[2] = {(pixel_px[0] - lens->cx_px) / lens->fx_px,
                                 (pixel_px[1] - lens->cy_px) / lens->fy_px};
    double ideal[2], angle;
    if (lens_undistort(lens, distorted, ideal)) {
        direction[0] = ideal[0];
        direction[1] = ideal[1];
        direction[2] = 1.0;
        return true;
    }
    const double radius = sqrt(norm2(distorted));
    INVARIANT(!(radius < 0));
    if (lens->kind != LENS_EQUIDISTANT || !find_angle(lens, radius, &angle)) {
        return false;
    }
    direction[0] = math_sin(angle) * distorted[0] / radius;
    direction[1] = math_sin(angle) * distorted[1] / radius;
    direction[2] = math_cos(angle);
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
        if (!lens_ray(lens, pixel_px, direction) || !lens_sees(radius, direction)) {
            return false;
        }
    }
    return true;
}

static bool has_legal_coefficients(const struct lens *lens) {
    if ((int)lens->kind < 0 || lens->kind >= LENS_KINDS) {
        return false;
    }
    // The coefficients, and which kinds have them besides the rational one.
    const bool plane = lens->kind != LENS_EQUIDISTANT, rational = lens->kind == LENS_RATIONAL;
    const struct {
        double value;
        bool has;
    } k[8] = {{lens->k1, true},     {lens->k2, true},
              {lens->p1, plane},    {lens->p2, plane},
              {lens->k3, true},     {lens->k4, lens->kind != LENS_BROWN_CONRADY},
              {lens->k5, rational}, {lens->k6, rational}};
    for (int i = 0; i < 8; i++) {
        const double limit = k[i].has ? LENS_COEFFICIENT_MAX : 0;
        if (!within(k[i].value, -limit, limit)) {
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
    if (!has_legal_coefficients(lens)) {
        return ERROR_RANGE;
    }
    if (!within(lens->fx_px, LENS_FOCAL_MIN_PX, LENS_FOCAL_MAX_PX) ||
        !within(lens->fy_px, LENS_FOCAL_MIN_PX, LENS_FOCAL_MAX_PX) ||
        !within(lens->cx_px, -LENS_CENTRE_MAX_PX, LENS_CENTRE_MAX_PX) ||
        !within(lens->cy_px, -LENS_CENTRE_MAX_PX, LENS_CENTRE_MAX_PX)) {
        return ERROR_RANGE;
    }
    return sees_central_half(lens) ? ERROR_OK : ERROR_DISTORTION;
}

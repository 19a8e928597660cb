// SPDX-License-Identifier: Apache-2.0
// Reweighted least squares in integers; floating point solves the normal equations, whose sums are
// exact.
#include "stereo/row_trend.h"

#include <stdbool.h>

#include "core/invariant.h"

enum {
    ROUNDS = 10,
    CONVERGED_Q12 = 2,  // change of the surface that is too small to matter: 0.0005 px
    PLANE_TERMS = 3,
    SURFACE_MAX_TERMS = 6,
    ONE_Q12 = 1 << 12,
    VALUE_MAX_Q12 = 4 * ONE_Q12,  // of a surface at a sample, beyond all that is measured
};

static int magnitude(int value) {
    return value < 0 ? -value : value;
}

// A polynomial over the lattice: offset, slopes, and with degree 2 its curvature and twist.
struct surface {
    int degree;
    int64_t factor_q28[SURFACE_MAX_TERMS];  // px
};
// Powers of x and y in its terms.
static const uint8_t X_POWER[SURFACE_MAX_TERMS] = {0, 1, 0, 2, 1, 0};
static const uint8_t Y_POWER[SURFACE_MAX_TERMS] = {0, 0, 1, 0, 1, 2};

// Writes |measured value - value of the surface| at each sample, or the surface's alone. Returns
// the greatest change of what was there.
static int find_distances(const struct surface *surface, bool is_alone,
                          const struct row_sample *samples, int count, int16_t *distance_q12) {
    INVARIANT(surface->degree == 1 || surface->degree == 2);
    const int64_t *f = surface->factor_q28;
    int64_t offset_q28 = 0, slope_q28 = 0;
    int greatest = 0;
    for (int i = 0; i < count; i++) {
        const int x = samples[i].x, y = samples[i].y;
        if (i == 0 || y != samples[i - 1].y) {
            offset_q28 = f[0] + y * (f[2] + y * f[5]);
            slope_q28 = f[1] + y * f[4];
        }
        const int64_t value = (offset_q28 + x * (slope_q28 + x * f[3])) >> 16;
        const int value_q12 = (int)(value < -VALUE_MAX_Q12  ? -VALUE_MAX_Q12
                                    : value < VALUE_MAX_Q12 ? value
                                                            : VALUE_MAX_Q12);
        const int distance = magnitude((is_alone ? 0 : samples[i].vertical_q12) - value_q12);
        const int change = magnitude(distance - distance_q12[i]);
        greatest = change > greatest ? change : greatest;
        distance_q12[i] = (int16_t)distance;
    }
    return greatest;
}

// Sums over samples of the weight times x^a y^b, and times the measured value.
struct moments {
    int64_t weight[5][5], vertical[3][3];
};

static void add_row(struct moments *moments, int degree, int y, const int64_t weight[5],
                    const int64_t vertical[3]) {
    int64_t power = 1;
    for (int b = 0; b <= 2 * degree; b++, power *= y) {
        for (int a = 0; a + b <= 2 * degree; a++) {
            moments->weight[a][b] += weight[a] * power;
        }
        for (int a = 0; a + b <= degree; a++) {
            moments->vertical[a][b] += vertical[a] * power;
        }
    }
}

// With Cauchy's weights, 1 / (1 + (distance / scale)^2).
static void sum_moments(const struct row_sample *samples, int count, const int16_t *distance_q12,
                        int scale_q12, int degree, struct moments *moments) {
    INVARIANT(scale_q12 > 0 && scale_q12 <= 1 << 24);
    const int per_distance_q16 = (1 << 24) / scale_q12;
    const int far_q12 = INT32_MAX / per_distance_q16;  // without weight from here
    for (int i = 0; i < count;) {
        const int y = samples[i].y;
        int64_t weights[5] = {0}, verticals[3] = {0};
        for (; i < count && samples[i].y == y; i++) {
            const int distance = distance_q12[i] < far_q12 ? distance_q12[i] : far_q12;
            const int ratio_q8 = (distance * per_distance_q16) >> 16;
            const int weight = (1 << 28) / ((1 << 16) + ratio_q8 * ratio_q8);  // 1: 2^12
            const int x = samples[i].x;
            const int weight_x2 = weight * (x * x);
            const int vertical = weight * samples[i].vertical_q12;
            weights[0] += weight;
            weights[1] += weight * x;
            weights[2] += weight_x2;
            verticals[0] += vertical;
            verticals[1] += (int64_t)vertical * x;
            if (degree == 2) {
                weights[3] += (int64_t)weight_x2 * x;
                weights[4] += (int64_t)weight_x2 * (x * x);
                verticals[2] += (int64_t)vertical * (x * x);
            }
        }
        add_row(moments, degree, y, weights, verticals);
    }
}

struct normal_equations {
    double a[SURFACE_MAX_TERMS][SURFACE_MAX_TERMS], b[SURFACE_MAX_TERMS];
};

// Solves a symmetric system of equations by elimination, overwriting it; false if it is close to
// singular.
static bool solve(struct normal_equations *n, int terms, double result[SURFACE_MAX_TERMS]) {
    INVARIANT(terms > 0 && terms <= SURFACE_MAX_TERMS);
    double share = 1.0;
    for (int i = 0; i < terms; i++) {
        const double diagonal = n->a[i][i];
        for (int k = 0; k < i; k++) {
            const double factor = n->a[i][k] / n->a[k][k];
            for (int j = k; j < terms; j++) {
                n->a[i][j] -= factor * n->a[k][j];
            }
            n->b[i] -= factor * n->b[k];
        }
        share *= n->a[i][i] / diagonal;
        if (!(diagonal > 0.0 && share > 1e-9)) {
            return false;
        }
    }
    for (int i = terms - 1; i >= 0; i--) {
        double rest = n->b[i];
        for (int j = i + 1; j < terms; j++) {
            rest -= n->a[i][j] * result[j];
        }
        result[i] = rest / n->a[i][i];
    }
    return true;
}

// Replaces a surface by the solution for sums over samples; false if it is not determined.
static bool solve_surface(const struct moments *moments, struct surface *surface) {
    const int terms = surface->degree == 1 ? PLANE_TERMS : SURFACE_MAX_TERMS;
    struct normal_equations n;
    for (int j = 0; j < terms; j++) {
        for (int k = 0; k < terms; k++) {
            n.a[j][k] = (double)moments->weight[X_POWER[j] + X_POWER[k]][Y_POWER[j] + Y_POWER[k]];
        }
        n.b[j] = (double)moments->vertical[X_POWER[j]][Y_POWER[j]];
    }
    double solution_q12[SURFACE_MAX_TERMS];
    if (!solve(&n, terms, solution_q12)) {
        return false;
    }
    const double limit = 1 << 23;  // no sums of values overflow
    for (int j = 0; j < terms; j++) {
        if (!(solution_q12[j] < limit && solution_q12[j] > -limit)) {
            return false;
        }
    }
    for (int j = 0; j < terms; j++) {
        surface->factor_q28[j] = (int64_t)(solution_q12[j] * (1 << 16));
    }
    return true;
}

// The value at `percent` of the sorted ones, by bisection.
static int quantile(const int16_t *values, int count, int percent) {
    INVARIANT(count > 0 && percent >= 0 && percent <= 100);
    const int rank = (count - 1) * percent / 100;
    int low = INT16_MIN, high = INT16_MAX;
    while (low < high) {
        const int middle = (low + high) >> 1;
        int up_to = 0;
        for (int i = 0; i < count; i++) {
            up_to += values[i] <= middle;
        }
        if (up_to > rank) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return low;
}

// Reweighted least squares from a first surface; the scale of the weights is the median distance.
// Returns that scale.
static int fit(const struct row_sample *samples, int count, int16_t *work,
               struct surface *surface) {
    int scale_q12 = 0;
    for (int round = 0; round < ROUNDS; round++) {
        const int change = find_distances(surface, false, samples, count, work);
        if (round > 0 && change <= CONVERGED_Q12) {
            break;
        }
        // 1.4826 times the median, and 0.001 px.
        scale_q12 = ((quantile(work, count, 50) * 6073) >> 12) + 4;
        struct moments moments = {{{0}}, {{0}}};
        sum_moments(samples, count, work, 2 * scale_q12, surface->degree, &moments);
        if (!solve_surface(&moments, surface)) {
            break;
        }
    }
    return scale_q12;
}

static double pixels_of(int value_q12) {
    return value_q12 / (double)ONE_Q12;
}

void row_trend_fit(const struct row_sample *samples, int count, int16_t *work,
                   struct row_trend *trend) {
    INVARIANT(count > 0);
    for (int i = 0; i < count; i++) {
        work[i] = samples[i].vertical_q12;
    }
    struct surface plane = {.degree = 1,
                            .factor_q28 = {(int64_t)quantile(work, count, 50) * (1 << 16)}};
    for (int i = 0; i < count; i++) {
        work[i] = (int16_t)magnitude(work[i]);
    }
    trend->median_px = pixels_of(quantile(work, count, 50));
    trend->p95_px = pixels_of(quantile(work, count, 95));
    trend->scatter_px = pixels_of(fit(samples, count, work, &plane));
    struct surface curve = plane;
    curve.degree = 2;
    (void)fit(samples, count, work, &curve);
    (void)find_distances(&plane, true, samples, count, work);
    trend->plane_p95_px = pixels_of(quantile(work, count, 95));
    for (int i = 0; i < PLANE_TERMS; i++) {
        const double unit = 1 << 28;
        trend->plane_px[i] = (double)plane.factor_q28[i] / unit;
        curve.factor_q28[i] -= plane.factor_q28[i];
    }
    (void)find_distances(&curve, true, samples, count, work);
    trend->curve_p95_px = pixels_of(quantile(work, count, 95));
}

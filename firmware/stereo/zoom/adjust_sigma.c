// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "core/cholesky.h"
#include "core/invariant.h"
#include "stereo/zoom/adjustment.h"

static double sigma_of(const double *factor, int n, const double *gradient) {
    double square = 0;
    for (int j = 0; j < n; j++) {
        double sum = 0;
        for (int i = 0; i < n; i++) {
            sum += gradient[i] * factor[i * n + j];
        }
        square += sum * sum;
    }
    return sqrt(square);
}

double adjust_prior_sigma(const struct adjustment *adjustment, const double *gradient) {
    return sigma_of(adjustment->prior, adjustment->terms, gradient);
}

double adjust_posterior_sigma(const struct adjustment *adjustment, const double *gradient) {
    return sigma_of(adjustment->posterior, adjustment->terms, gradient);
}

void adjust_extra_term(const struct adjustment *adjustment, int term, double *change,
                       double *sigma) {
    const double *row = adjustment->work + (size_t)term * (size_t)adjustment->terms;
    INVARIANT(term >= 0 && term < adjustment->terms);
    // What the corrections do not absorb of it.
    const double absorbed = adjust_posterior_sigma(adjustment, row);
    const double weight = row[term] - absorbed * absorbed;
    const bool seen = weight > 1e-11 * row[term];
    *change = seen ? adjustment->pull[term] / weight : 0;
    *sigma = seen ? 1 / sqrt(weight) : INFINITY;
}

// Chi-square of the corrections under the prior, and its degrees of freedom: what pictures show.
struct chi_square {
    double value, shown;
};

static struct chi_square chi_square_of(const struct adjustment *adjustment) {
    const int n = adjustment->terms;
    double part[ADJUST_TERMS_MAX], square = 0, left = 0;
    INVARIANT(n > 0 && n <= ADJUST_TERMS_MAX);
    // In the independent parts of the prior, each of variance 1, of which `left` remain unknown.
    for (int i = 0; i < n; i++) {
        part[i] = adjustment->correction[i];
    }
    cholesky_forward(adjustment->prior, n, part, 1);
    for (int i = 0; i < n; i++) {
        square += part[i] * part[i];
    }
    int parts = 0;
    for (int k = 0; k < n; k++) {
        parts += adjustment->prior[k * n + k] > 0;
        for (int i = 0; i < n; i++) {
            part[i] = adjustment->posterior[i * n + k];
        }
        cholesky_forward(adjustment->prior, n, part, 1);
        for (int i = 0; i < n; i++) {
            left += part[i] * part[i];
        }
    }
    return (struct chi_square){square, parts - left};
}

double adjust_chi_square_score(const struct adjustment *adjustment) {
    const struct chi_square test = chi_square_of(adjustment);
    return test.shown > 0.5 ? (test.value - test.shown) / sqrt(2 * test.shown) : 0;
}

double adjust_birge_ratio(const struct adjustment *adjustment) {
    const struct chi_square test = chi_square_of(adjustment);
    return test.shown > 0.5 && test.value > test.shown ? sqrt(test.value / test.shown) : 1;
}

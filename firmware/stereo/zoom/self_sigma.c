// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "core/cholesky.h"
#include "core/invariant.h"
#include "stereo/zoom/self_calibration.h"

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

double self_prior_sigma(const struct self_calibration *self, const double *gradient) {
    return sigma_of(self->prior, self->terms, gradient);
}

double self_posterior_sigma(const struct self_calibration *self, const double *gradient) {
    return sigma_of(self->posterior, self->terms, gradient);
}

void self_calibration_beside(const struct self_calibration *self, int term, double *change,
                             double *sigma) {
    const double *row = self->work + (size_t)term * (size_t)self->terms;
    INVARIANT(term >= 0 && term < self->terms);
    // What the corrections do not absorb of it.
    const double absorbed = self_posterior_sigma(self, row);
    const double weight = row[term] - absorbed * absorbed;
    const bool seen = weight > 1e-11 * row[term];
    *change = seen ? self->pull[term] / weight : 0;
    *sigma = seen ? 1 / sqrt(weight) : INFINITY;
}

// Chi-square of the corrections under the prior, and its degrees of freedom: what pictures show.
struct chi_square {
    double value, shown;
};

static struct chi_square chi_square_of(const struct self_calibration *self) {
    const int n = self->terms;
    double part[SELF_TERMS_MAX], square = 0, left = 0;
    INVARIANT(n > 0 && n <= SELF_TERMS_MAX);
    // In the independent parts of the prior, each of variance 1, of which `left` remain unknown.
    for (int i = 0; i < n; i++) {
        part[i] = self->correction[i];
    }
    cholesky_forward(self->prior, n, part, 1);
    for (int i = 0; i < n; i++) {
        square += part[i] * part[i];
    }
    int parts = 0;
    for (int k = 0; k < n; k++) {
        parts += self->prior[k * n + k] > 0;
        for (int i = 0; i < n; i++) {
            part[i] = self->posterior[i * n + k];
        }
        cholesky_forward(self->prior, n, part, 1);
        for (int i = 0; i < n; i++) {
            left += part[i] * part[i];
        }
    }
    return (struct chi_square){square, parts - left};
}

double self_surprise(const struct self_calibration *self) {
    const struct chi_square test = chi_square_of(self);
    return test.shown > 0.5 ? (test.value - test.shown) / sqrt(2 * test.shown) : 0;
}

double self_growth(const struct self_calibration *self) {
    const struct chi_square test = chi_square_of(self);
    return test.shown > 0.5 && test.value > test.shown ? sqrt(test.value / test.shown) : 1;
}

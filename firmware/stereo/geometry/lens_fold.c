// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/lens_fold.h"

#include <math.h>

#include "core/invariant.h"

static double value_at(const struct lens_fold_polynomial *polynomial, double u) {
    double sum = polynomial->c[polynomial->degree];
    for (int i = polynomial->degree - 1; i >= 0; i--) {
        sum = sum * u + polynomial->c[i];
    }
    return sum;
}

// The change of sign between `low` and `high`, to some 14 digits.
static double bisect(const struct lens_fold_polynomial *polynomial, double low, double high) {
    const bool positive = value_at(polynomial, low) > 0;
    while (high - low > 1e-14 * high && high > 1e-30) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) {
            break;
        }
        if ((value_at(polynomial, middle) > 0) == positive) {
            low = middle;
        } else {
            high = middle;
        }
    }
    INVARIANT(low <= high);
    return low;
}

// Changes of sign in (0, end], ascending; returns their number. Between two of them the derivative
// of a polynomial has one, so each derivative's separate those of the one before it.
static int sign_changes(const struct lens_fold_polynomial *polynomial, double end,
                        double root[LENS_FOLD_DEGREE_MAX]) {
    int roots = 0;
    for (int degree = 1; degree <= polynomial->degree; degree++) {
        struct lens_fold_polynomial derivative = *polynomial;
        while (derivative.degree > degree) {
            for (int i = 0; i < derivative.degree; i++) {
                derivative.c[i] = derivative.c[i + 1] * (i + 1);
            }
            derivative.degree--;
        }
        double found[LENS_FOLD_DEGREE_MAX], low = 0;
        int count = 0;
        for (int i = 0; i <= roots; i++) {
            const double high = i < roots ? root[i] : end;
            if ((value_at(&derivative, low) > 0) != (value_at(&derivative, high) > 0)) {
                INVARIANT(count < degree);
                found[count++] = bisect(&derivative, low, high);
            }
            low = high;
        }
        roots = count;
        for (int i = 0; i < roots; i++) {
            root[i] = found[i];
        }
    }
    return roots;
}

// The first u in (0, end] at which a polynomial that is positive at 0 is not; INFINITY if none.
static double first_loss(const struct lens_fold_polynomial *polynomial, double end) {
    double root[LENS_FOLD_DEGREE_MAX];
    INVARIANT(polynomial->c[0] > 0 && polynomial->degree <= LENS_FOLD_DEGREE_MAX);
    return sign_changes(polynomial, end, root) > 0 ? root[0] : INFINITY;
}

double lens_fold_first(const struct lens_fold_growth *growth, double end) {
    INVARIANT(end > 0);
    const double fold = first_loss(&growth->slope, end), pole = first_loss(&growth->below, end);
    return fold < pole ? fold : pole;
}

// Whether a polynomial cannot fall to 0 before u, whatever the signs of its coefficients.
static bool is_safe(const struct lens_fold_polynomial *polynomial, double u) {
    double sum = 0;
    for (int i = polynomial->degree; i > 0; i--) {
        sum = (sum + (polynomial->c[i] < 0 ? -polynomial->c[i] : polynomial->c[i])) * u;
    }
    return sum < polynomial->c[0];
}

bool lens_fold_is_safe(const struct lens_fold_growth *growth, double u) {
    INVARIANT(growth->slope.c[0] == 1 && growth->below.c[0] == 1);
    return is_safe(&growth->slope, u) && is_safe(&growth->below, u);
}

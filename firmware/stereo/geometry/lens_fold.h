// SPDX-License-Identifier: Apache-2.0
/// Where the radial mapping of a lens stops growing: signs of polynomials of the squared radius, or
/// of the squared angle.
#ifndef VERGENCE_STEREO_GEOMETRY_LENS_FOLD_H
#define VERGENCE_STEREO_GEOMETRY_LENS_FOLD_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { LENS_FOLD_DEGREE_MAX = 6 };

/// A polynomial of u by its coefficients, the constant one first.
struct lens_fold_polynomial {
    int degree;
    double c[LENS_FOLD_DEGREE_MAX + 1];
};

/// What must stay positive along the radius, as polynomials of the squared radius that are 1 at 0:
/// the slope of the radial mapping, times the square of its denominator, and the denominator. Of an
/// equidistant lens: of the squared angle.
struct lens_fold_growth {
    struct lens_fold_polynomial slope, below;
};

/// The first u in (0, end] at which one of both is not positive; INFINITY if none.
double lens_fold_first(const struct lens_fold_growth *growth, double end);

/// Whether neither can fall to 0 up to u, whatever the signs of the coefficients: a quick test that
/// most lenses pass.
bool lens_fold_is_safe(const struct lens_fold_growth *growth, double u);

#ifdef __cplusplus
}
#endif

#endif

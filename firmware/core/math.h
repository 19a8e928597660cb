// SPDX-License-Identifier: Apache-2.0
/// Elementary functions built from + - * / and sqrt only, so that results are bit-identical on
/// every target (a C library gives different results for the same argument on processors with and
/// without fused multiply-add). For the error see each function. Compile with -ffp-contract=off.
#ifndef VERGENCE_CORE_MATH_H
#define VERGENCE_CORE_MATH_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MATH_PI 3.14159265358979323846
#define MATH_RAD_PER_DEGREE (MATH_PI / 180.0)
#define MATH_DEGREE_PER_RAD (180.0 / MATH_PI)

/// Sine and cosine of an angle in rad, |angle_rad| <= 1e6; absolute error <= 4e-16.
/// NaN for NaN, infinities and larger angles.
double math_sin(double angle_rad);
double math_cos(double angle_rad);

/// Angle of the finite point (x, y) in rad, in (-pi, pi]; 0 for (0, 0); relative error <= 4e-16
/// unless the ratio of both is below 1e-290. NaN if either is NaN.
double math_atan2(double y, double x);

/// e to the power x; relative error <= 1e-15 for normal results; 0 below -746, infinity above
/// 709.79. NaN for NaN.
double math_exp(double x);

/// Natural logarithm; relative error <= 1e-15 away from 1, absolute 2e-16 near 1.
/// NaN for x < 0 and NaN, minus infinity for 0, infinity for infinity.
double math_log(double x);

/// Square root of x^2 + y^2, |x| and |y| <= 1e150; relative error <= 4e-16 above 1e-140.
double math_hypot(double x, double y);

/// Nearest integer not above x, not below x, and nearest to x (halves away from 0); x itself for
/// NaN and infinities.
double math_floor(double x);
double math_ceil(double x);
double math_round(double x);

/// The larger and the smaller of two numbers; the other one if one is NaN.
static inline double math_max(double a, double b) {
    return a > b || b != b ? a : b;
}
static inline double math_min(double a, double b) {
    return a < b || b != b ? a : b;
}

/// The nearest value in [min, max], min <= max; NaN for NaN.
static inline double math_clamp(double value, double min, double max) {
    if (value < min) {
        return min;
    }
    return value > max ? max : value;
}
static inline int32_t math_clamp_int(int32_t value, int32_t min, int32_t max) {
    if (value < min) {
        return min;
    }
    return value > max ? max : value;
}

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// Argument reduction with split constants (W. J. Cody and W. Waite, "Software manual for the
// elementary functions", 1980), then Taylor series: on the reduced ranges they need few terms,
// and their coefficients can be checked by eye.
#include "core/math.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "core/invariant.h"

// pi/2 in parts of 33 bits, so that multiples up to 2^20 of the first parts are exact.
static const double HALF_PI_1 = 0x1.921fb544p+0;
static const double HALF_PI_2 = 0x1.0b4611a6p-34;
static const double HALF_PI_3 = 0x1.3198a2ep-69;
// pi/2 and pi/4 as doubles, and their remainders.
static const double HALF_PI = 0x1.921fb54442d18p+0;
static const double HALF_PI_REST = 0x1.1a62633145c07p-54;
// ln 2 with 42 bits, so that multiples up to 2^11 are exact, and its remainder.
static const double LN_2_HIGH = 0x1.62e42fefa38p-1;
static const double LN_2_LOW = 0x1.ef35793c7673p-45;

static const double ANGLE_MAX_RAD = 1e6;

// Integer nearest to x, |x| < 2^31.
static int32_t nearest(double x) {
    INVARIANT(x > -2147483648.0 && x < 2147483647.0);
    return (int32_t)(x < 0 ? x - 0.5 : x + 0.5);
}

// x 2^exponent for normal results, |exponent| <= 1022.
static double scale_by_power_of_2(double x, int exponent) {
    INVARIANT(exponent >= -1022 && exponent <= 1022);
    const uint64_t bits = (uint64_t)(1023 + exponent) << 52;
    double power;
    memcpy(&power, &bits, sizeof power);
    return x * power;
}

// |r| <= pi/4; the first omitted term is below 1e-19.
static double sin_near_zero(double r) {
    const double u = r * r;
    double sum = 1.0 / 355687428096000.0;
    sum = sum * u - 1.0 / 1307674368000.0;
    sum = sum * u + 1.0 / 6227020800.0;
    sum = sum * u - 1.0 / 39916800.0;
    sum = sum * u + 1.0 / 362880.0;
    sum = sum * u - 1.0 / 5040.0;
    sum = sum * u + 1.0 / 120.0;
    sum = sum * u - 1.0 / 6.0;
    return r + r * u * sum;
}

static double cos_near_zero(double r) {
    const double u = r * r;
    double sum = 1.0 / 20922789888000.0;
    sum = sum * u - 1.0 / 87178291200.0;
    sum = sum * u + 1.0 / 479001600.0;
    sum = sum * u - 1.0 / 3628800.0;
    sum = sum * u + 1.0 / 40320.0;
    sum = sum * u - 1.0 / 720.0;
    sum = sum * u + 1.0 / 24.0;
    return 1.0 - 0.5 * u + u * u * sum;
}

// Sine of angle + quarters pi/2.
static double sin_shifted(double angle_rad, int quarters) {
    if (!(angle_rad >= -ANGLE_MAX_RAD && angle_rad <= ANGLE_MAX_RAD)) {
        return NAN;
    }
    const int32_t turns = nearest(angle_rad / HALF_PI);
    const double k = (double)turns;
    const double r = ((angle_rad - k * HALF_PI_1) - k * HALF_PI_2) - k * HALF_PI_3;
    INVARIANT(r > -0.79 && r < 0.79);
    const uint32_t quadrant = ((uint32_t)turns + (uint32_t)quarters) & 3u;
    const double magnitude = (quadrant & 1u) != 0 ? cos_near_zero(r) : sin_near_zero(r);
    return (quadrant & 2u) != 0 ? -magnitude : magnitude;
}

double math_sin(double angle_rad) {
    return sin_shifted(angle_rad, 0);
}

double math_cos(double angle_rad) {
    return sin_shifted(angle_rad, 1);
}

// 1 / n for n = 3, 5, ... 45. Quotients of constants in a loop are computed each time, and cost a
// processor without floating point more than all the rest of the series.
static const double ODD_RECIPROCAL[] = {
    1.0 / 3.0,  1.0 / 5.0,  1.0 / 7.0,  1.0 / 9.0,  1.0 / 11.0, 1.0 / 13.0, 1.0 / 15.0, 1.0 / 17.0,
    1.0 / 19.0, 1.0 / 21.0, 1.0 / 23.0, 1.0 / 25.0, 1.0 / 27.0, 1.0 / 29.0, 1.0 / 31.0, 1.0 / 33.0,
    1.0 / 35.0, 1.0 / 37.0, 1.0 / 39.0, 1.0 / 41.0, 1.0 / 43.0, 1.0 / 45.0,
};

// |t| <= tan(pi/8); the first omitted term is below 1e-18 of the result.
static double atan_near_zero(double t) {
    const double u = t * t;
    double sum = 0;
    for (int n = 45; n >= 3; n -= 2) {
        sum = ODD_RECIPROCAL[(n - 3) / 2] - u * sum;
    }
    return t - t * u * sum;
}

// Angle whose tangent is small / large, 0 <= small <= large, in [0, pi/4].
static double atan_of_ratio(double small, double large) {
    const double t = small / large;
    if (t <= 0.41421356237309503) {
        return atan_near_zero(t);
    }
    const double rest = atan_near_zero((t - 1.0) / (t + 1.0));
    return 0.5 * HALF_PI + (rest + 0.5 * HALF_PI_REST);
}

double math_atan2(double y, double x) {
    if (x != x || y != y) {
        return NAN;
    }
    const double width = x < 0 ? -x : x;
    const double height = y < 0 ? -y : y;
    if (width == 0 && height == 0) {
        return 0;
    }
    double angle_rad;
    if (height <= width) {
        angle_rad = atan_of_ratio(height, width);
        if (x < 0) {
            angle_rad = 2.0 * HALF_PI - (angle_rad - 2.0 * HALF_PI_REST);
        }
    } else {
        angle_rad = atan_of_ratio(width, height);
        angle_rad =
            x < 0 ? HALF_PI + (angle_rad + HALF_PI_REST) : HALF_PI - (angle_rad - HALF_PI_REST);
    }
    return y < 0 ? -angle_rad : angle_rad;
}

double math_exp(double x) {
    if (x != x) {
        return x;
    }
    if (x > 709.79) {
        return INFINITY;
    }
    if (x < -746.0) {
        return 0;
    }
    const int32_t twos = nearest(x / (LN_2_HIGH + LN_2_LOW));
    const double k = (double)twos;
    const double r = (x - k * LN_2_HIGH) - k * LN_2_LOW;
    INVARIANT(r > -0.35 && r < 0.35);
    double sum = 0;
    for (int n = 14; n >= 2; n--) {  // Taylor: 1 + r + r^2 (1/2! + r/3! + ...)
        sum = (1.0 + r * sum) / (double)n;
    }
    // Two steps: 2^k alone may leave the range of a double before the result does.
    const int first = twos / 2;
    return scale_by_power_of_2(scale_by_power_of_2(1.0 + (r + r * r * sum), first), twos - first);
}

double math_log(double x) {
    if (x != x || x < 0) {
        return NAN;
    }
    if (x == 0) {
        return -INFINITY;
    }
    if (x > 1.7976931348623157e308) {
        return INFINITY;
    }
    int twos = 0;
    if (x < 0x1p-1022) {
        x *= 0x1p54;
        twos = -54;
    }
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    twos += (int)(bits >> 52) - 1023;
    bits = (bits & 0xfffffffffffffu) | 0x3ff0000000000000u;
    double m;
    memcpy(&m, &bits, sizeof m);
    if (m > 1.4142135623730951) {
        m *= 0.5;
        twos++;
    }
    INVARIANT(m > 0.70 && m < 1.42);
    // ln m = 2 artanh(f), f = (m - 1) / (m + 1), as f (2 + 2/3 f^2 + ...).
    const double f = (m - 1.0) / (m + 1.0);
    const double u = f * f;
    double sum = 0;
    for (int n = 23; n >= 3; n -= 2) {
        sum = 2.0 / (double)n + u * sum;
    }
    const double k = (double)twos;
    return k * LN_2_HIGH + (2.0 * f + (f * u * sum + k * LN_2_LOW));
}

double math_hypot(double x, double y) {
    return sqrt(x * x + y * y);
}

// The integer towards 0; x itself where every double is an integer, and for NaN.
static double truncate(double x) {
    return x > -0x1p52 && x < 0x1p52 ? (double)(int64_t)x : x;
}

double math_floor(double x) {
    const double whole = truncate(x);
    return whole > x ? whole - 1 : whole;
}

double math_ceil(double x) {
    return -math_floor(-x);
}

double math_round(double x) {
    const double whole = truncate(x), rest = x - whole;
    if (rest >= 0.5) {
        return whole + 1;
    }
    return rest <= -0.5 ? whole - 1 : whole;
}

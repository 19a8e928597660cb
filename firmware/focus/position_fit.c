// SPDX-License-Identifier: Apache-2.0
#include "focus/position_fit.h"

#include <math.h>
#include <stdbool.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "core/order.h"

enum {
    WINDOW_MAX = 2 * POSITION_FIT_NEIGHBOURS,
    SLOPES_MAX = WINDOW_MAX * (WINDOW_MAX - 1) / 2,
    LINE_MIN = 4,          // readings of a line
    LINE_OUTLIER_MIN = 6,  // readings of a line that may include an outlier
    Q4 = 16,
};

static const double noise_counts = 1, noise_readings = 4;  // assumed before any are seen
static const double sigma_of_mad = 1.4826;
static const double outlier_sigmas = 4, outlier_max_counts = 8;
static const double line_noise_counts = 2;  // more: it is not a line

// A straight line; times relative to that wanted, in s.
struct line {
    double at, slope;
};

// Sorts them.
static double median(double *values, unsigned count) {
    INVARIANT(count > 0);
    order_sort(values, count);
    return count % 2 == 1 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

// Residuals beyond this are outliers.
static double outlier_limit(const double *residuals, unsigned count) {
    double sizes[POSITION_FIT_MAX];
    INVARIANT(count <= POSITION_FIT_MAX);
    for (unsigned i = 0; i < count; i++) {
        sizes[i] = fabs(residuals[i]);
    }
    const double sigma = sigma_of_mad * median(sizes, count);
    const double limit = outlier_sigmas * (sigma > noise_counts ? sigma : noise_counts);
    return limit < outlier_max_counts ? limit : outlier_max_counts;
}

// Variance of a reading, from `free` degrees of freedom and what is assumed.
static double variance(double squares, unsigned freedom) {
    return (squares + noise_readings * noise_counts * noise_counts) / (freedom + noise_readings);
}

static void result(double position, double error, int32_t *position_q4, uint16_t *sigma_q4) {
    const double sigma = math_ceil(error * Q4);
    INVARIANT(fabs(position) < INT32_MAX / Q4 && sigma >= 0);
    *position_q4 = (int32_t)math_floor(position * Q4 + 0.5);
    *sigma_q4 = (uint16_t)math_clamp(sigma, 1, UINT16_MAX);
}

int32_t position_fit_counts(int32_t position_q4) {
    return (int32_t)math_floor((double)position_q4 / Q4 + 0.5);
}

void position_fit_mean(const struct position_sample *samples, unsigned count, int32_t *position_q4,
                       uint16_t *sigma_q4) {
    double values[POSITION_FIT_MAX], residuals[POSITION_FIT_MAX];
    INVARIANT(count > 0 && count <= POSITION_FIT_MAX);
    for (unsigned i = 0; i < count; i++) {
        values[i] = samples[i].counts;
    }
    const double middle = median(values, count);
    for (unsigned i = 0; i < count; i++) {
        residuals[i] = values[i] - middle;
    }
    const double limit = outlier_limit(residuals, count);
    double sum = 0, squares = 0;
    unsigned used = 0;
    for (unsigned i = 0; i < count; i++) {
        if (fabs(residuals[i]) <= limit) {
            sum += residuals[i];
            squares += residuals[i] * residuals[i];
            used++;
        }
    }
    if (used == 0) {  // two readings far apart
        result(middle, limit, position_q4, sigma_q4);
        return;
    }
    const double mean = sum / used;
    const double error = sqrt(variance(squares - sum * mean, used - 1) / used);
    result(middle + mean, error, position_q4, sigma_q4);
}

// The median of the slopes between any two readings, then of the heights (Theil and Sen).
static struct line robust_line(const double *times, const double *values, unsigned count) {
    double slopes[SLOPES_MAX], heights[WINDOW_MAX];
    unsigned pairs = 0;
    for (unsigned i = 0; i < count; i++) {
        for (unsigned j = i + 1; j < count; j++) {
            slopes[pairs++] = (values[j] - values[i]) / (times[j] - times[i]);
        }
    }
    struct line line = {.slope = median(slopes, pairs)};
    for (unsigned i = 0; i < count; i++) {
        heights[i] = values[i] - line.slope * times[i];
    }
    line.at = median(heights, count);
    return line;
}

// Least squares over the readings near a robust line. Whether they are on a line: at most one is an
// outlier, and the others' noise is that of readings.
static bool fit_line(const struct position_sample *samples, unsigned count, uint64_t time_us,
                     double *position, double *error) {
    double times[WINDOW_MAX], values[WINDOW_MAX], residuals[WINDOW_MAX];
    INVARIANT(count >= LINE_MIN && count <= WINDOW_MAX);
    for (unsigned i = 0; i < count; i++) {
        times[i] = ((double)samples[i].time_us - (double)time_us) * 1e-6;
        values[i] = samples[i].counts;
    }
    const struct line line = robust_line(times, values, count);
    for (unsigned i = 0; i < count; i++) {
        residuals[i] = values[i] - line.at - line.slope * times[i];
    }
    const double limit = outlier_limit(residuals, count);
    double n = 0, t = 0, r = 0, tt = 0, tr = 0, rr = 0;
    for (unsigned i = 0; i < count; i++) {
        if (fabs(residuals[i]) <= limit) {
            n++;
            t += times[i];
            r += residuals[i];
            tt += times[i] * times[i];
            tr += times[i] * residuals[i];
            rr += residuals[i] * residuals[i];
        }
    }
    if (n < LINE_MIN || n + (count < LINE_OUTLIER_MIN ? 0 : 1) < count) {
        return false;
    }
    const double times_spread = tt - t * t / n;  // sum of squared deviations of the readings' times
    const double slope = (tr - t * r / n) / times_spread;
    const double squares = rr - r * r / n - slope * slope * times_spread;
    const unsigned freedom = (unsigned)n - 2;
    *position = line.at + (r - slope * t) / n;
    *error = sqrt(variance(squares, freedom) * (1 / n + t * t / n / n / times_spread));
    return squares <= line_noise_counts * line_noise_counts * freedom;
}

// Copies the readings without those far from the median of three, which a motor that moves
// steadily, starts or stops does not change. Returns their number.
static unsigned without_outliers(const struct position_sample *from, unsigned count,
                                 struct position_sample *to) {
    unsigned kept = 0;
    for (unsigned i = 0; i < count; i++) {
        const double next = i + 1 < count ? from[i + 1].counts : from[i].counts;
        double three[] = {i > 0 ? from[i - 1].counts : from[i].counts, from[i].counts, next};
        if (fabs(from[i].counts - median(three, 3)) <= outlier_max_counts) {
            to[kept++] = from[i];
        }
    }
    return kept;
}

// Between two readings, if it turns there, or if there are too few for a line.
static double interpolate(const struct position_sample *a, const struct position_sample *b,
                          uint64_t time_us, double *error) {
    const double way = (double)b->counts - (double)a->counts;
    const double gap_us = (double)(b->time_us - a->time_us);
    const double share = gap_us > 0 ? (double)(time_us - a->time_us) / gap_us : 0;
    *error = noise_counts + fabs(way) / 4;
    return a->counts + share * way;
}

// The line through readings before and after a time whose error is least, if there is one.
static void fit_lines(const struct position_sample *good, unsigned kept, unsigned after,
                      uint64_t time_us, double *position, double *error) {
    const unsigned before = after == 0 ? 0 : after - 1;
    const unsigned first =
        before + 1 > POSITION_FIT_NEIGHBOURS ? before + 1 - POSITION_FIT_NEIGHBOURS : 0;
    double least = HUGE_VAL;
    for (unsigned begin = first; begin <= before; begin++) {
        for (unsigned end = after; end < kept && end < after + POSITION_FIT_NEIGHBOURS; end++) {
            double at, at_error;
            if (end - begin + 1 >= LINE_MIN &&
                fit_line(&good[begin], end - begin + 1, time_us, &at, &at_error) &&
                at_error < least) {
                least = *error = at_error;
                *position = at;
            }
        }
    }
}

int position_fit_at(const struct position_sample *samples, unsigned count, uint64_t time_us,
                    int32_t *position_q4, uint16_t *sigma_q4) {
    struct position_sample good[POSITION_FIT_MAX];
    unsigned after = 0;
    INVARIANT(count <= POSITION_FIT_MAX);
    const unsigned kept = without_outliers(samples, count, good);
    while (after < kept && good[after].time_us < time_us) {
        after++;
    }
    if (after == kept) {
        return ERROR_NOT_READY;
    }
    if (after == 0 && good[0].time_us > time_us) {
        return ERROR_MISSING;
    }
    const unsigned before = after == 0 ? 0 : after - 1;
    if (good[after].time_us - good[before].time_us > POSITION_FIT_GAP_US) {
        return ERROR_MISSING;
    }
    double error;
    double position = interpolate(&good[before], &good[after], time_us, &error);
    fit_lines(good, kept, after, time_us, &position, &error);
    result(position, error, position_q4, sigma_q4);
    return ERROR_OK;
}

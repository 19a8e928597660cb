// SPDX-License-Identifier: Apache-2.0
#include "focus/focus_stop.h"

#include <math.h>

#include "core/invariant.h"
#include "core/math.h"

enum { PLACES = 41, WIDTHS = 3, HEIGHTS = 5, POSITIONS = 7 };

// Standard deviations of a fitted peak besides the one that the fit reports: of its place, in
// counts, since frames of a moving ring have positions with errors; of its width and height, in
// parts of them.
static const double place_deviation = 0.7, width_deviation = 0.15, height_deviation = 0.04;
// The grid of each reaches as many deviations to both sides.
static const double reach = 2.5;
// Of a rest that shows something else.
static const double unlikely = 1e-6;

// Deviations from the mean, and their weight.
static double grid(unsigned i, unsigned count) {
    return reach * (2.0 * i / (count - 1) - 1);
}

static double weight_of(double u) {
    return math_exp(-u * u / 2);
}

// How likely a rest is, and that times its distance from the peak, over the positions that the ring
// may have had.
static double likelihood(const struct focus_peak *peak, const double position_weights[POSITIONS],
                         const struct focus_stop_sample *rest, double *distance) {
    double sum = 0, sum_distance = 0, weights = 0;
    for (unsigned i = 0; i < POSITIONS; i++) {
        const double u = grid(i, POSITIONS);
        const double position = rest->position + u * rest->position_deviation;
        const double expected = focus_peak_at(peak, position);
        const double off = (rest->sharpness - expected) / rest->sharpness_deviation;
        const double weight = position_weights[i];
        const double part = weight * (weight_of(off) + unlikely);
        weights += weight;
        sum += part;
        sum_distance += part * fabs(position - peak->position);
    }
    *distance = sum_distance / weights;
    return sum / weights;
}

// Sums over all peaks.
struct place_sums {
    double weight, position, distance;
};

static void add_peak(struct place_sums *sums, const struct focus_peak *peak, double prior,
                     const double position_weights[POSITIONS],
                     const struct focus_stop_sample *stops, unsigned count) {
    double weight = prior, distance = 0;
    for (unsigned i = 0; i + 1 < count; i++) {
        weight *= likelihood(peak, position_weights, &stops[i], &distance);
    }
    const double last = likelihood(peak, position_weights, &stops[count - 1], &distance);
    sums->distance += weight * distance;
    weight *= last;
    sums->weight += weight;
    sums->position += weight * peak->position;
}

struct focus_peak_estimate focus_stop_estimate(const struct focus_peak *peak,
                                               const struct focus_stop_sample *stops,
                                               unsigned count) {
    INVARIANT(count > 0 && peak->half_width >= 0 && peak->height >= peak->floor);
    const double prior = math_hypot(peak->deviation, place_deviation);
    const double half = math_max(peak->half_width, 0.5), height = peak->height - peak->floor;
    struct place_sums sums = {.weight = 0};
    double position_weights[POSITIONS];
    for (unsigned i = 0; i < POSITIONS; i++) {
        position_weights[i] = weight_of(grid(i, POSITIONS));
    }
    for (unsigned p = 0; p < PLACES; p++) {
        for (unsigned w = 0; w < WIDTHS; w++) {
            for (unsigned h = 0; h < HEIGHTS; h++) {
                const double up = grid(p, PLACES), uw = grid(w, WIDTHS), uh = grid(h, HEIGHTS);
                struct focus_peak here = *peak;
                here.position += up * prior;
                here.half_width = half * (1 + width_deviation * uw);
                here.height = here.floor + height * (1 + height_deviation * uh);
                add_peak(&sums, &here, weight_of(up) * weight_of(uw) * weight_of(uh),
                         position_weights, stops, count);
            }
        }
    }
    return (struct focus_peak_estimate){
        .position = sums.position / sums.weight,
        .distance = sums.distance / sums.weight,
    };
}

// SPDX-License-Identifier: Apache-2.0
// The place of a peak from what its curve and the rests near it showed.
#include "focus/focus_stop.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

constexpr double kHalfWidth = 4, kHeight = 1, kFloor = 0.1;

struct focus_peak peak_at(double position) {
    return {position, 0.2, kHalfWidth, kHeight, kFloor, 20, false};
}

struct focus_stop_sample rest_at(double position, const struct focus_peak &truth) {
    return {position, 0.05, focus_peak_at(&truth, position), 0.01};
}

}  // namespace

TEST_CASE("a rest off the peak does not say on which side, two do") {
    const struct focus_peak fitted = peak_at(500), truth = peak_at(501);
    const struct focus_stop_sample rests[] = {rest_at(500, truth), rest_at(502, truth)};
    const struct focus_peak_estimate one = focus_stop_estimate(&fitted, rests, 1);
    CHECK(std::abs(one.position - 500) < 0.1);
    CHECK(one.distance > 0.5);
    const struct focus_peak_estimate two = focus_stop_estimate(&fitted, rests, 2);
    CHECK(std::abs(two.position - 501) < 0.3);
    CHECK(std::abs(two.distance - 1) < 0.3);
}

TEST_CASE("a picture unlike that of the peak leaves the place that the curve showed") {
    const struct focus_peak fitted = peak_at(500);
    const struct focus_stop_sample rest = {500, 0.05, 5 * kHeight, 0.01};
    const struct focus_peak_estimate place = focus_stop_estimate(&fitted, &rest, 1);
    CHECK(place.position == doctest::Approx(500));
    CHECK(std::isfinite(place.distance));
}

// Draws whose errors are those that the model states: the reported distance is that of the truth
// in the mean, and the place is nearer to it than the curve's.
TEST_CASE("the distance is that of random peaks") {
    const unsigned seed = 20261125;
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    constexpr int kDraws = 400;
    double distance = 0, true_distance = 0, error = 0, fitted_error = 0;
    for (int draw = 0; draw < kDraws; draw++) {
        struct focus_peak truth = peak_at(500 + 0.73 * normal(random));
        truth.half_width *= 1 + 0.1 * normal(random);
        const struct focus_peak fitted = peak_at(500);
        struct focus_stop_sample rests[3];
        double ring = 0;
        for (struct focus_stop_sample &rest : rests) {
            ring = 500 + 1.5 * normal(random);
            rest = {ring + 0.3 * normal(random), 0.3,
                    focus_peak_at(&truth, ring) + 0.015 * normal(random), 0.015};
        }
        const struct focus_peak_estimate place = focus_stop_estimate(&fitted, rests, 3);
        distance += place.distance;
        true_distance += std::abs(ring - truth.position);
        error += std::pow(place.position - truth.position, 2);
        fitted_error += std::pow(500 - truth.position, 2);
    }
    CHECK(distance / true_distance > 0.9);
    CHECK(distance / true_distance < 1.1);
    CHECK(error < 0.5 * fitted_error);
}

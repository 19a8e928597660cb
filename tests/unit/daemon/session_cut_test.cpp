// SPDX-License-Identifier: Apache-2.0
// A calibration of the whole sensor, cut to frames of a part of it.
#include <doctest/doctest.h>

#include <random>

#include "console/pair/calibration_fit.h"
#include "synthetic/seed.hpp"

namespace {

lens whole() {
    lens made{};
    made.width_px = 2048;
    made.height_px = 1536;
    made.fx_px = made.fy_px = 2670.787421090;
    made.cx_px = 1030;
    made.cy_px = 763.3;
    made.k1 = -0.3;
    made.p2 = 0.001;
    return made;
}

/// Sensor position of pixel `u` for a sensor that reads pixels in pairs and skips pairs.
double array_px(unsigned first, unsigned skip, unsigned u) {
    return first + 2.0 * skip * (u / 2) + u % 2;
}

}  // namespace

TEST_CASE("agrees with the simulated rig's cameras for these windows") {
    const struct {
        pair_window window;
        int size_px[2];
        double f_px, centre_px[2];
    } cases[] = {
        {{640, 480, 1}, {768, 576}, 2670.787421090, {390, 283.3}},
        {{674, 518, 1}, {700, 500}, 2670.787421090, {356, 245.3}},
        {{256, 192, 2}, {768, 576}, 1335.393710545, {387.25, 285.9}},
        {{256, 192, 3}, {512, 384}, 890.262473697, {258.333333333, 190.766666667}},
    };
    const lens from = whole();
    for (const auto &expected : cases) {
        const lens cut =
            calibration_fit_lens(&from, &expected.window, expected.size_px[0], expected.size_px[1]);
        CHECK(cut.width_px == expected.size_px[0]);
        CHECK(cut.height_px == expected.size_px[1]);
        CHECK(cut.fx_px == doctest::Approx(expected.f_px).epsilon(1e-11));
        CHECK(cut.fy_px == cut.fx_px);
        CHECK(cut.cx_px == doctest::Approx(expected.centre_px[0]).epsilon(1e-9));
        CHECK(cut.cy_px == doctest::Approx(expected.centre_px[1]).epsilon(1e-9));
        CHECK(cut.k1 == from.k1);
        CHECK(cut.p2 == from.p2);
    }
}

TEST_CASE("a direction is seen at the mean position of its pair of sensor pixels") {
    std::mt19937_64 random(synthetic::test_seed());
    const lens from = whole();
    for (int i = 0; i < 1000; i++) {
        const pair_window window{static_cast<std::uint16_t>(random() % 1000 * 2),
                                 static_cast<std::uint16_t>(random() % 700 * 2),
                                 static_cast<std::uint8_t>(1 + random() % 8)};
        const lens cut = calibration_fit_lens(&from, &window, 64, 48);
        const auto u = static_cast<unsigned>(random() % 32 * 2);
        const double sensor_px = (array_px(window.column_px, window.skip, u) +
                                  array_px(window.column_px, window.skip, u + 1)) /
                                 2;
        const double slope = (sensor_px - from.cx_px) / from.fx_px;
        CHECK(cut.cx_px + slope * cut.fx_px == doctest::Approx(u + 0.5).epsilon(1e-9));
    }
}

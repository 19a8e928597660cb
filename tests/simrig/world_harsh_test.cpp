// SPDX-License-Identifier: Apache-2.0
// What rigs/harsh.yaml adds to a lens, against the law that each number stands for; without it
// nothing changes.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/simrig/world_harness.hpp"

using namespace world_harness;

namespace {

world::Optics at_zoom(const world::Lens &lens, double position) {
    world::Mechanics m;
    m.zoom = position;
    return world::optics_of(lens, 3.2, m);
}

}  // namespace

TEST_CASE("an exponential lens multiplies f by the same factor with every count") {
    world::Lens lens = perfect_rig().camera[0].lens;
    lens.exponential = 1;
    for (double position = 300; position < 850; position += 11) {
        const double factor =
            at_zoom(lens, position + 11).focal_px / at_zoom(lens, position).focal_px;
        CHECK(factor == doctest::Approx(std::pow(10.0, 11 / 550.0)).epsilon(1e-12));
    }
    CHECK(at_zoom(lens, 300).focal_length_mm == doctest::Approx(8.5).epsilon(1e-12));
    CHECK(at_zoom(lens, 850).focal_length_mm == doctest::Approx(85).epsilon(1e-12));
    // A count is 0.42 % of f everywhere, where the straight line has 1.64 % at 1x and 0.16 % at
    // 10x.
    CHECK(at_zoom(lens, 301).focal_px / at_zoom(lens, 300).focal_px - 1 ==
          doctest::Approx(0.0042).epsilon(0.01));
    // Half of it lies in the middle.
    const double whole = at_zoom(lens, 500).focal_px;
    lens.exponential = 0;
    const double none = at_zoom(lens, 500).focal_px;
    lens.exponential = 0.5;
    CHECK(at_zoom(lens, 500).focal_px == doctest::Approx(0.5 * (whole + none)));
}

TEST_CASE("an irregular image centre stays within its limit and follows no low polynomial") {
    world::Lens lens = perfect_rig().camera[0].lens;
    const world::Vec2 still = at_zoom(lens, 500).centre_px;
    lens.centre_irregular_px = {90, 70};
    double low = 0, high = 0, worst_between = 0;
    for (double position = 300; position <= 850; position += 0.5) {
        const world::Vec2 off = at_zoom(lens, position).centre_px - still;
        CHECK(std::fabs(off.x) <= 90);
        CHECK(std::fabs(off.y) <= 70);
        low = std::min(low, off.x);
        high = std::max(high, off.x);
    }
    CHECK(high > 60);
    CHECK(low < -60);
    // Halfway between 13 zooms a straight line misses it by many pixels: a calibration cannot know
    // it to better than what it allows for an irregular lens.
    for (int i = 0; i < 12; i++) {
        const double a = 300 + 550 * i / 12.0, b = 300 + 550 * (i + 1) / 12.0;
        const world::Vec2 mean = 0.5 * (at_zoom(lens, a).centre_px + at_zoom(lens, b).centre_px);
        const world::Vec2 middle = at_zoom(lens, 0.5 * (a + b)).centre_px;
        worst_between = std::max(worst_between, length(mean - middle));
    }
    MESSAGE("worst of the straight lines: " << worst_between << " px");
    CHECK(worst_between > 10);
    // Yet a count moves it by little, so that a motor's last count is not what it shows.
    for (double position = 300; position < 850; position += 1) {
        CHECK(length(at_zoom(lens, position + 1).centre_px - at_zoom(lens, position).centre_px) <
              5);
    }
}

// SPDX-License-Identifier: Apache-2.0
// The thin lens's formulas against rays that are traced through it, and against known figures.
#include "focus/lens_optics.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "synthetic/seed.hpp"

namespace {

constexpr double kPixelMm = 3.2e-3;

lens_optics nominal() {
    return {{300, 850}, {300, 850}, {300, 850}, 8.5, 85, 800, 1.6, 16};
}

// A ray from a point on the axis at `distance` in front of the lens through height `h` in the lens,
// which bends it by h / f: its height at a plane `image` behind the lens.
double ray_height(double f, double distance, double h, double image) {
    const double slope = std::isinf(distance) ? 0 : h / distance;
    return h + (slope - h / f) * image;
}

// Where the sensor must be for the rays of a distance to meet: by bisection.
double sensor_for(double f, double distance) {
    double near = f * 0.5, far = f * 3;
    for (int i = 0; i < 200; i++) {
        const double middle = (near + far) / 2;
        (ray_height(f, distance, 1, middle) > 0 ? near : far) = middle;
    }
    return near;
}

// Diameter of the spot that all rays make.
double traced_blur(const lens_state &state, double distance) {
    const double image = sensor_for(state.focal_length_mm, state.focus_distance_mm);
    const double radius = state.focal_length_mm / state.f_number / 2;
    double low = INFINITY, high = -INFINITY;
    for (int i = -50; i <= 50; i++) {
        const double y = ray_height(state.focal_length_mm, distance, radius * i / 50, image);
        low = std::min(low, y);
        high = std::max(high, y);
    }
    return high - low;
}

}  // namespace

TEST_CASE("blur and image distance are those of traced rays") {
    std::mt19937_64 random(synthetic::test_seed());
    std::uniform_real_distribution<double> focal(8.5, 85), f_number(1.6, 16), per_mm(0, 1 / 800.0);
    for (int i = 0; i < 2000; i++) {
        const double s = per_mm(random), u = per_mm(random);
        const lens_state state = {focal(random), f_number(random), i % 10 == 0 ? INFINITY : 1 / s};
        const double distance = i % 7 == 0 ? INFINITY : 1 / u;
        CAPTURE(state.focal_length_mm);
        CAPTURE(distance);
        REQUIRE(lens_image_distance(state.focal_length_mm, state.focus_distance_mm) ==
                doctest::Approx(sensor_for(state.focal_length_mm, state.focus_distance_mm)));
        REQUIRE(lens_blur(&state, distance) ==
                doctest::Approx(traced_blur(state, distance)).epsilon(1e-6));
    }
}

TEST_CASE("rings: the ends are those of the data sheet, and each inverse undoes its relation") {
    const lens_optics optics = nominal();
    CHECK(lens_optics_focal_length(&optics, 300) == doctest::Approx(8.5));
    CHECK(lens_optics_focal_length(&optics, 850) == doctest::Approx(85));
    CHECK(std::isinf(lens_optics_distance(&optics, 300)));
    CHECK(std::isinf(lens_optics_distance(&optics, 290)));
    CHECK(lens_optics_distance(&optics, 850) == doctest::Approx(800));
    CHECK(lens_optics_distance(&optics, 575) == doctest::Approx(1600));
    CHECK(lens_optics_f_number(&optics, 850) == doctest::Approx(1.6));
    CHECK(lens_optics_f_number(&optics, 300) == doctest::Approx(16));
    CHECK(lens_optics_focus_for(&optics, INFINITY) == 300);
    for (double position = 305; position <= 850; position += 13.7) {
        CHECK(lens_optics_zoom_for(&optics, lens_optics_focal_length(&optics, position)) ==
              doctest::Approx(position));
        CHECK(lens_optics_focus_for(&optics, lens_optics_distance(&optics, position)) ==
              doctest::Approx(position));
        CHECK(lens_optics_iris_for(&optics, lens_optics_f_number(&optics, position)) ==
              doctest::Approx(position));
    }
    // The same number of stops for each count.
    CHECK(lens_optics_f_number(&optics, 400) / lens_optics_f_number(&optics, 450) ==
          doctest::Approx(lens_optics_f_number(&optics, 700) / lens_optics_f_number(&optics, 750)));
}

TEST_CASE("one count of focus makes the blur that two neighbouring positions differ by") {
    const lens_optics optics = nominal();
    for (const double zoom : {300, 500, 850}) {
        const double focus = 544;
        const lens_state state = {lens_optics_focal_length(&optics, zoom), 2,
                                  lens_optics_distance(&optics, focus)};
        CHECK(lens_blur_per_count(&optics, &state) ==
              doctest::Approx(traced_blur(state, lens_optics_distance(&optics, focus + 1))));
    }
    // 85 mm at f/2 and 1.8 m.
    const lens_state tele = {85, 2, 1800};
    CHECK(lens_blur_per_count(&optics, &tele) / kPixelMm == doctest::Approx(2.7).epsilon(0.01));
}

TEST_CASE("depth of field: the ends are blurred as far as allowed") {
    // Known figures for 85 mm at 1.8 m and a blur of 3.2 um.
    const struct {
        double f_number, before, behind;
    } known[] = {{1.6, 2.2, 2.2}, {4, 5.5, 5.5}, {8, 10.9, 11.0}};
    for (const auto &row : known) {
        const lens_state state = {85, row.f_number, 1800};
        double near_mm = 0, far_mm = 0;
        lens_sharp_range(&state, kPixelMm, &near_mm, &far_mm);
        CHECK(std::abs(1800 - near_mm - row.before) < 0.06);
        CHECK(std::abs(far_mm - 1800 - row.behind) < 0.06);
        CHECK(traced_blur(state, near_mm) == doctest::Approx(kPixelMm));
        CHECK(traced_blur(state, far_mm) == doctest::Approx(kPixelMm));
    }
    const lens_state wide = {8.5, 16, 1800};
    double near_mm = 0, far_mm = 0;
    lens_sharp_range(&wide, 2 * kPixelMm, &near_mm, &far_mm);
    CHECK(std::isinf(far_mm));
    CHECK(near_mm > 0);
}

TEST_CASE("f-numbers for a range: neither more blur than allowed nor more diffraction than blur") {
    const lens_state state = {85, 1.6, 1800};
    const double needed = lens_f_number_for_blur(&state, 1789, 1811, kPixelMm);
    lens_state closed = state;
    closed.f_number = needed;
    CHECK(std::max(traced_blur(closed, 1789), traced_blur(closed, 1811)) ==
          doctest::Approx(kPixelMm));
    const double most = lens_f_number_for_diffraction(&state, 1789, 1811);
    closed.f_number = most;
    const double blur = lens_blur(&closed, 1789);
    CHECK(blur == doctest::Approx(lens_diffraction(most)));
    // There the total is smallest.
    for (const double factor : {0.8, 0.95, 1.05, 1.25}) {
        lens_state other = state;
        other.f_number = most * factor;
        CHECK(std::hypot(lens_blur(&other, 1789), lens_diffraction(other.f_number)) >
              std::hypot(blur, lens_diffraction(most)));
    }
    CHECK(lens_f_number_for_blur(&state, 1800, 1800, kPixelMm) == 0);
}

TEST_CASE("diffraction spreads light by 0.6 px rms at f/8") {
    // A disc's rms along one axis is a quarter of its diameter.
    CHECK(lens_diffraction(8) / 4 / kPixelMm == doctest::Approx(0.58).epsilon(0.01));
    CHECK(lens_diffraction(16) == doctest::Approx(2 * lens_diffraction(8)));
}

TEST_CASE("the middle of a range blurs its ends equally") {
    for (const double far : {1000.0, 1900.0, double(INFINITY)}) {
        const double middle = lens_range_middle(900, far);
        const lens_state state = {50, 4, middle};
        CHECK(traced_blur(state, 900) == doctest::Approx(traced_blur(state, far)));
    }
    CHECK(std::isinf(lens_range_middle(INFINITY, INFINITY)));
}

// SPDX-License-Identifier: Apache-2.0
// What both cameras see, against points that the simulated rig's formulas project.
#include "measure/zoom_field.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "core/error.h"
#include "measure/measure_place.h"
#include "measure/zoom_forecast.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/zoom_aim.h"
#include "synthetic/seed.hpp"
#include "synthetic/zoom_rig.hpp"

namespace {

using Random = std::mt19937_64;

double uniform(Random &random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

void project(const zoom_state &state, int side, const double point_mm[3], double pixel_px[2]) {
    const auto &at = state.side[side];
    const auto camera =
        zoom_rig::camera_at(side, at.zoom_counts, at.focus_counts, at.pan_rad, false);
    const auto pixel = camera.project({point_mm[0], point_mm[1], point_mm[2]});
    REQUIRE(pixel);
    pixel_px[0] = pixel->x;
    pixel_px[1] = pixel->y;
}

// Whether both cameras see the point, by `slack_px`.
bool both_see(const zoom_state &state, const double point_mm[3], double dx, double dy,
              double slack_px) {
    const double at_mm[3] = {point_mm[0] + dx, point_mm[1] + dy, point_mm[2]};
    for (int side = 0; side < 2; side++) {
        double pixel_px[2];
        project(state, side, at_mm, pixel_px);
        if (pixel_px[0] < -slack_px || pixel_px[0] > 2047 + slack_px || pixel_px[1] < -slack_px ||
            pixel_px[1] > 1535 + slack_px) {
            return false;
        }
    }
    return true;
}

// A state aimed at a point, or nearly.
zoom_state aimed(const zoom_calibration &calibration, Random &random, double point_mm[3]) {
    const double distance_mm = uniform(random, 1200, 4000);
    zoom_state state = zoom_rig::state(uniform(random, 305, 845), distance_mm);
    zoom_point_ahead(&calibration, distance_mm, uniform(random, -100, 100), point_mm);
    REQUIRE(zoom_aim(&calibration, point_mm, &state, nullptr) == ERROR_OK);
    state.side[1].zoom_counts = uniform(random, 305, 845);
    const double narrow = 1000 / zoom_rig::camera_at(0, 845, 300, 0, false).fx;
    state.side[0].pan_rad += uniform(random, -0.5, 0.5) * narrow;
    REQUIRE(zoom_focus_at(&calibration, point_mm, &state) == ERROR_OK);
    return state;
}

}  // namespace

TEST_CASE("the field is what both cameras see, with the point in its middle") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    const auto calibration = zoom_rig::calibration();
    for (int i = 0; i < 50; i++) {
        double point_mm[3];
        const zoom_state state = aimed(*calibration, random, point_mm);
        zoom_field field;
        REQUIRE(zoom_field_at(calibration.get(), nullptr, &state, point_mm, &field) == ERROR_OK);
        REQUIRE(field.width_mm > 0);
        const double x = field.width_mm / 2, y = field.height_mm / 2;
        CHECK((both_see(state, point_mm, x, 0, 1.5) && both_see(state, point_mm, -x, 0, 1.5)));
        CHECK((both_see(state, point_mm, 0, y, 1.5) && both_see(state, point_mm, 0, -y, 1.5)));
        CHECK_FALSE((both_see(state, point_mm, 1.01 * x, 0, 0.5) &&
                     both_see(state, point_mm, -1.01 * x, 0, 0.5)));
        CHECK_FALSE((both_see(state, point_mm, 0, 1.01 * y, 0.5) &&
                     both_see(state, point_mm, 0, -1.01 * y, 0.5)));
        // Area of a square millimetre in both pictures; a toed-in camera sees it at up to 6
        // degrees.
        double density = INFINITY;
        for (int side = 0; side < 2; side++) {
            double middle_px[2], right_px[2], below_px[2];
            const double right_mm[3] = {point_mm[0] + 1, point_mm[1], point_mm[2]};
            const double below_mm[3] = {point_mm[0], point_mm[1] + 1, point_mm[2]};
            project(state, side, point_mm, middle_px);
            project(state, side, right_mm, right_px);
            project(state, side, below_mm, below_px);
            density = std::fmin(density,
                                std::hypot(right_px[0] - middle_px[0], right_px[1] - middle_px[1]) *
                                    (below_px[1] - middle_px[1]));
        }
        CHECK(field.density_per_mm2 == doctest::Approx(density).epsilon(0.03));
        const double centred = zoom_field_centred(calibration.get(), nullptr, &state, &field);
        CHECK((centred > 0 && centred <= 1));
    }
}

TEST_CASE("a window shows its part of the field, a skip fewer pixels of it") {
    const auto calibration = zoom_rig::calibration();
    const zoom_state state = zoom_rig::state(500, 1800);
    double point_mm[3];
    zoom_point_ahead(calibration.get(), 1800, 0, point_mm);
    zoom_field whole, part, thin;
    REQUIRE(zoom_field_at(calibration.get(), nullptr, &state, point_mm, &whole) == ERROR_OK);
    const calibration_window windows[2] = {{704, 528, 1}, {704, 528, 1}},
                             all[2] = {{0, 0, 2}, {0, 0, 2}};
    const zoom_frames middle = zoom_frames_of(windows, 640, 480),
                      every = zoom_frames_of(all, 1024, 768);
    REQUIRE(zoom_field_at(calibration.get(), &middle, &state, point_mm, &part) == ERROR_OK);
    REQUIRE(zoom_field_at(calibration.get(), &every, &state, point_mm, &thin) == ERROR_OK);
    double half_px[2] = {320, 240};
    for (int axis = 0; axis < 2; axis++) {
        const double middle_px = axis == 0 ? 1023.5 : 767.5, size_px = axis == 0 ? 640 : 480;
        for (const auto &pixel_px : part.pixel_px) {
            half_px[axis] =
                std::fmin(half_px[axis], size_px / 2 - std::fabs(pixel_px[axis] - middle_px));
        }
    }
    const double px_per_mm = std::sqrt(part.density_per_mm2);
    CHECK(part.width_mm == doctest::Approx(2 * half_px[0] / px_per_mm).epsilon(0.02));
    CHECK(part.height_mm == doctest::Approx(2 * half_px[1] / px_per_mm).epsilon(0.02));
    CHECK(part.density_per_mm2 == whole.density_per_mm2);
    CHECK(thin.width_mm == doctest::Approx(whole.width_mm));
    CHECK(thin.density_per_mm2 == doctest::Approx(whole.density_per_mm2 / 4));
    CHECK(thin.depth_per_px_mm == doctest::Approx(whole.depth_per_px_mm * 2));
    zoom_state zoomed = state;
    zoom_range reach{};
    const zoom_wish wish = {ZOOM_WISH_WIDTH, 200};
    REQUIRE(zoom_for_wish(calibration.get(), &middle, &wish, point_mm, &zoomed, &reach) ==
            ERROR_OK);
    REQUIRE(zoom_field_at(calibration.get(), &middle, &zoomed, point_mm, &part) == ERROR_OK);
    CHECK(part.width_mm >= 200);
    CHECK(part.width_mm < 210);
    CHECK(reach.max < 450);
    CHECK(zoom_field_centred(calibration.get(), &middle, &zoomed, &part) > 0.9);
}

TEST_CASE("depth per pixel of disparity is that of a point further away") {
    const auto calibration = zoom_rig::calibration();
    for (const double zoom : {300.0, 500.0, 850.0}) {
        const zoom_state state = zoom_rig::state(zoom, 1800);
        double point_mm[3], near_px[2][2], far_px[2][2];
        zoom_point_ahead(calibration.get(), 1800, 0, point_mm);
        zoom_field field;
        REQUIRE(zoom_field_at(calibration.get(), nullptr, &state, point_mm, &field) == ERROR_OK);
        const double further_mm[3] = {point_mm[0], point_mm[1], point_mm[2] + 1};
        for (int side = 0; side < 2; side++) {
            project(state, side, point_mm, near_px[side]);
            project(state, side, further_mm, far_px[side]);
        }
        const double disparity_px = (near_px[0][0] - near_px[1][0]) - (far_px[0][0] - far_px[1][0]);
        CHECK(field.depth_per_px_mm == doctest::Approx(1 / disparity_px).epsilon(0.03));
        CHECK(field.baseline_mm == doctest::Approx(250).epsilon(0.1));
    }
}

TEST_CASE("the range of densities at 2 m is the paper's") {
    const auto calibration = zoom_rig::calibration();
    for (const auto &[zoom, density] : {std::pair{300.0, 1.8}, std::pair{850.0, 176.0}}) {
        const zoom_state state = zoom_rig::state(zoom, 2000);
        double point_mm[3];
        zoom_point_ahead(calibration.get(), 2000, 0, point_mm);
        zoom_field field;
        REQUIRE(zoom_field_at(calibration.get(), nullptr, &state, point_mm, &field) == ERROR_OK);
        CHECK(field.density_per_mm2 == doctest::Approx(density).epsilon(0.1));
    }
}

TEST_CASE("zoom for a wish meets it, and no count further does") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed + 1);
    const auto calibration = zoom_rig::calibration();
    for (int i = 0; i < 60; i++) {
        double point_mm[3];
        const zoom_state before = aimed(*calibration, random, point_mm);
        zoom_range reach{};
        zoom_wish wish = {static_cast<zoom_wish_kind>(i % 3), -1};
        zoom_state state = before;
        CHECK(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) ==
              ERROR_RANGE);
        CHECK(std::memcmp(&state, &before, sizeof state) == 0);
        REQUIRE(reach.max > reach.min);
        wish.value = uniform(random, reach.min, reach.max);
        INFO("kind ", int(wish.kind), " value ", wish.value);
        REQUIRE(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) ==
                ERROR_OK);
        CHECK(state.side[0].pan_rad == before.side[0].pan_rad);
        const double further = wish.kind == ZOOM_WISH_WIDTH ? 1 : -1;
        const auto offer = [&](const zoom_state &at) {
            zoom_field field;
            REQUIRE(zoom_field_at(calibration.get(), nullptr, &at, point_mm, &field) == ERROR_OK);
            return wish.kind == ZOOM_WISH_DENSITY ? field.density_per_mm2 : field.width_mm;
        };
        for (int side = 0; side < 2; side++) {
            CHECK(state.side[side].zoom_counts == std::round(state.side[side].zoom_counts));
            zoom_state one = state;
            one.side[side].zoom_counts += further;
            if (wish.kind == ZOOM_WISH_FACTOR || one.side[side].zoom_counts < 300 ||
                one.side[side].zoom_counts > 850) {
                continue;
            }
            // The other side has its own zoom, which is good enough.
            CHECK(offer(state) >= wish.value * (1 - 1e-12));
            REQUIRE(zoom_focus_at(calibration.get(), point_mm, &one) == ERROR_OK);
            CHECK(offer(one) < wish.value);
        }
    }
}

TEST_CASE("the ends of the zooms are met exactly") {
    const auto calibration = zoom_rig::calibration();
    double point_mm[3];
    zoom_point_ahead(calibration.get(), 1800, 0, point_mm);
    zoom_state state = zoom_rig::state(500, 1800);
    zoom_range reach{};
    zoom_wish wish = {ZOOM_WISH_FACTOR, 1};
    REQUIRE(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) == ERROR_OK);
    CHECK((state.side[0].zoom_counts == 300 && state.side[1].zoom_counts == 300));
    wish.value = reach.max;
    REQUIRE(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) == ERROR_OK);
    CHECK(std::fmax(state.side[0].zoom_counts, state.side[1].zoom_counts) == 850);
}

TEST_CASE("what is out of reach is named, and nothing changes") {
    const auto calibration = zoom_rig::calibration();
    const zoom_state before = zoom_rig::state(500, 1800);
    double point_mm[3];
    zoom_point_ahead(calibration.get(), 1800, 0, point_mm);
    zoom_state state = before;
    zoom_range reach{};
    zoom_wish wish = {ZOOM_WISH_DENSITY, 1000};
    CHECK(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) ==
          ERROR_RANGE);
    CHECK(reach.max == doctest::Approx(220).epsilon(0.1));
    CHECK(reach.min == doctest::Approx(2.2).epsilon(0.1));
    wish = {ZOOM_WISH_WIDTH, 5000};
    CHECK(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) ==
          ERROR_RANGE);
    CHECK(reach.max == doctest::Approx(1370).epsilon(0.05));
    wish.value = NAN;
    CHECK(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) ==
          ERROR_RANGE);
    // Nearer than the lenses focus, behind the cameras, and far to the side.
    zoom_field field{};
    for (const double distance_mm : {400.0, -1800.0}) {
        zoom_point_ahead(calibration.get(), distance_mm, 0, point_mm);
        wish = {ZOOM_WISH_FACTOR, 3};
        CHECK(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) ==
              ERROR_RANGE);
        CHECK(reach.min > reach.max);
    }
    CHECK(zoom_field_at(calibration.get(), nullptr, &state, point_mm, &field) == ERROR_RANGE);
    zoom_point_ahead(calibration.get(), 1800, 3000, point_mm);
    wish = {ZOOM_WISH_WIDTH, 100};
    CHECK(zoom_for_wish(calibration.get(), nullptr, &wish, point_mm, &state, &reach) ==
          ERROR_RANGE);
    CHECK(reach.max == 0);
    REQUIRE(zoom_field_at(calibration.get(), nullptr, &state, point_mm, &field) == ERROR_OK);
    CHECK(field.width_mm == 0);
    CHECK(std::memcmp(&state, &before, sizeof state) == 0);
}

TEST_CASE("a forecast has the iris of the depths and the errors of the rig") {
    const auto calibration = zoom_rig::calibration();
    const depth_iris_limits limits = {1.6, 16, INFINITY, 0}, dark = {1.6, 16, 2, 0};
    double point_mm[3];
    zoom_point_ahead(calibration.get(), 1800, 0, point_mm);
    zoom_forecast forecast{};
    const auto at = [&](double zoom, double near_mm, double far_mm, const depth_iris_limits *with) {
        const zoom_state state = zoom_rig::state(zoom, 1800);
        return zoom_forecast_at(calibration.get(), nullptr, &state, point_mm, near_mm, far_mm, with,
                                &forecast);
    };
    // The paper's rig at 1.8 m: 103 to 105 mm unrefined (calib/zoom/RESULTS.md), 4.9 mm a px at 1x.
    for (const double zoom : {300.0, 422.0, 850.0}) {
        REQUIRE(at(zoom, 0, 0, &limits) == ERROR_OK);
        CHECK(forecast.common_mm == doctest::Approx(100).epsilon(0.15));
        CHECK(forecast.iris.limit == DEPTH_IRIS_OPEN);
        CHECK(forecast.limit == ZOOM_FORECAST_COMMON);
    }
    CHECK(forecast.factor == doctest::Approx(10).epsilon(0.01));
    CHECK(forecast.point_mm ==
          doctest::Approx(0.1 * 1800 * 1800 / (26500 * 1.05 * 250)).epsilon(0.05));
    // Blur of the ends by the thin lens, 85 mm, focused on the middle of the dioptres.
    REQUIRE(at(850, 1790, 1810, &limits) == ERROR_OK);
    const double middle = 2 / (1 / 1790.0 + 1 / 1810.0), image = 85 * middle / (middle - 85);
    const double blur_mm = 85 / forecast.iris.f_number * image * (1 / 1790.0 - 1 / middle);
    CHECK(forecast.iris.blur_mm == doctest::Approx(blur_mm).epsilon(0.01));
    CHECK(forecast.has_iris);
    REQUIRE(at(850, 1500, 2200, &limits) == ERROR_OK);
    CHECK(forecast.limit == ZOOM_FORECAST_DEPTH);
    CHECK(forecast.iris.sharp_near_mm > 1500);
    CHECK(forecast.iris.sharp_far_mm < 2200);
    const double f_number = forecast.iris.f_number;
    REQUIRE(at(850, 1500, 2200, &dark) == ERROR_OK);
    CHECK(forecast.iris.f_number == 2);
    CHECK(forecast.iris.limit == DEPTH_IRIS_DARK);
    CHECK(f_number > 2);
    REQUIRE(at(300, 1700, 1900, nullptr) == ERROR_OK);
    CHECK_FALSE(forecast.has_iris);
    CHECK(at(850, 100, 2000, &limits) == ERROR_RANGE);
    zoom_point_ahead(calibration.get(), -500, 0, point_mm);
    CHECK(at(850, 0, 0, &limits) == ERROR_RANGE);
}

TEST_CASE("a pixel's line of sight leads to what it shows, wherever the cameras look now") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    const auto calibration = zoom_rig::calibration();
    for (int i = 0; i < 200; i++) {
        double point_mm[3];
        const zoom_state then = aimed(*calibration, random, point_mm);
        zoom_state now = then;
        for (auto &side : now.side) {
            side.pan_rad += uniform(random, -0.1, 0.1);
            side.zoom_counts = uniform(random, 305, 845);
        }
        zoom_field field;
        REQUIRE(zoom_field_at(calibration.get(), nullptr, &then, point_mm, &field) == ERROR_OK);
        for (int side = 0; side < 2; side++) {
            CAPTURE(side);
            measure_place place;
            measure_ray ray;
            REQUIRE(measure_place_of(calibration.get(), &then, side, field.pixel_px[side], &place));
            REQUIRE(measure_place_ray(&place, calibration.get(), &now, &ray));
            zoom_pair pair;
            zoom_pair_at(calibration->camera, &now, &pair);
            double arm_mm[3], left_mm[3];
            for (int axis = 0; axis < 3; axis++) {
                arm_mm[axis] = point_mm[axis] - pair.side[0].position_mm[axis];
            }
            geometry_rotate_back(pair.side[0].R_instrument_camera, arm_mm, left_mm);
            for (int axis = 0; axis < 2; axis++) {
                const double along_mm = left_mm[2] - ray.origin_um[2] * 1e-3;
                const double at_mm =
                    ray.origin_um[axis] * 1e-3 + along_mm * ray.slope_q20[axis] / (1 << 20);
                CHECK(std::abs(at_mm - left_mm[axis]) < 0.05);
            }
            for (double &part : place.direction) {
                part = -part;
            }
            CHECK_FALSE(measure_place_ray(&place, calibration.get(), &now, &ray));  // behind
        }
    }
}

// SPDX-License-Identifier: Apache-2.0
// What lens positions mean on an instrument: data sheet and tables together, what is missing, and
// irises for depths of field, against an independent search over all of them.
#include "rig/rig_optics.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "core/error.h"
#include "synthetic/seed.hpp"

namespace {

uint64_t now_us(void *) {
    return 1000;
}

const hal_clock_operations kOperations = [] {
    hal_clock_operations operations{};
    operations.now_us = now_us;
    return operations;
}();
const hal_clock kClock = {&kOperations, nullptr};

rig made(const char *profile, int zoom = 850, int focus = 544, int iris = 850) {
    rig made{};
    REQUIRE(rig_profile_named(profile, &made.profile) == ERROR_OK);
    made.ports.clock = &kClock;
    for (rig_camera &camera : made.camera) {
        camera.lens.commanded[LENS_ZOOM] = zoom;
        camera.lens.commanded[LENS_FOCUS] = focus;
        camera.lens.commanded[LENS_IRIS] = iris;
    }
    return made;
}

}  // namespace

TEST_CASE("positions and their meaning are inverse, within half a count") {
    rig up = made("rig");
    for (int position = 300; position <= 850; position += 11) {
        double value = 0;
        int32_t back = 0;
        REQUIRE(rig_optics_focal_length(&up, RIG_LEFT, position, &value) == ERROR_OK);
        REQUIRE(rig_optics_zoom_for(&up, RIG_LEFT, value, &back) == ERROR_OK);
        CHECK(back == position);
        REQUIRE(rig_optics_distance_at(&up, RIG_RIGHT, position, &value) == ERROR_OK);
        REQUIRE(rig_optics_focus_for(&up, RIG_RIGHT, value, &back) == ERROR_OK);
        CHECK(back == position);
        REQUIRE(rig_optics_f_number(&up, RIG_LEFT, position, &value) == ERROR_OK);
        REQUIRE(rig_optics_iris_for(&up, RIG_LEFT, value, &back) == ERROR_OK);
        CHECK(back == position);
    }
    int32_t position = 0;
    CHECK(rig_optics_zoom_for(&up, RIG_LEFT, 90, &position) == ERROR_RANGE);
    CHECK(rig_optics_focus_for(&up, RIG_LEFT, 700, &position) == ERROR_RANGE);
    CHECK(rig_optics_focus_for(&up, RIG_LEFT, NAN, &position) == ERROR_RANGE);
    CHECK(rig_optics_iris_for(&up, RIG_LEFT, 0, &position) == ERROR_RANGE);
    CHECK(rig_optics_iris_for(&up, RIG_LEFT, 22, &position) == ERROR_RANGE);
}

TEST_CASE("what is not known says which settings it needs") {
    rig plain = made("two-cameras"), lens = made("two-cameras-lens"), down = made("rig");
    double value = 0;
    int32_t position = 0, half_range = 0;
    CHECK(rig_optics_focal_length(&plain, RIG_LEFT, 300, &value) == ERROR_NOT_CONNECTED);
    CHECK(rig_optics_focal_length(&lens, RIG_LEFT, 300, &value) == ERROR_MISSING);
    CHECK(rig_optics_blur_per_count(&lens, RIG_LEFT, &value) == ERROR_MISSING);
    CHECK(rig_optics_focus_prediction(&lens, RIG_LEFT, &position, &half_range) == ERROR_MISSING);
    CHECK(std::string(rig_optics_missing(&lens, RIG_OPTICS_DISTANCE)) == "rig.focus_nearest");
    for (const auto relation :
         {RIG_OPTICS_FOCAL_LENGTH, RIG_OPTICS_DISTANCE, RIG_OPTICS_F_NUMBER, RIG_OPTICS_BLUR}) {
        CHECK(rig_optics_missing(&lens, relation) != nullptr);
        CHECK(rig_optics_missing(&down, relation) == nullptr);
    }
    for (int32_t &commanded : down.camera[RIG_LEFT].lens.commanded) {
        commanded = INT32_MIN;
    }
    for (auto &measured : down.camera[RIG_LEFT].lens.measured) {
        measured.position_q4 = INT32_MIN;
    }
    CHECK(rig_optics_blur_per_count(&down, RIG_LEFT, &value) == ERROR_NOT_READY);
    // The table works in counts, without a data sheet.
    REQUIRE(rig_optics_learn_focus(&lens, RIG_LEFT, 500 * 16, 16, 0) == ERROR_OK);
    REQUIRE(rig_optics_focus_prediction(&lens, RIG_RIGHT, &position, &half_range) == ERROR_OK);
    CHECK(position == 500);
    // With other lenses come other optics.
    REQUIRE(rig_profile_set_lenses(&down.profile, "v1lc") == ERROR_OK);
    CHECK(rig_optics_missing(&down, RIG_OPTICS_FOCAL_LENGTH) != nullptr);
}

TEST_CASE("learned tables replace the data sheet") {
    rig up = made("rig");
    lens_table &iris = up.camera[RIG_LEFT].lens.learned.iris;
    const lens_point points[] = {{300, 8000, 10, 1}, {600, 3000, 10, 1}, {850, 1000, 1, 1}};
    for (const lens_point &point : points) {
        lens_table_put(&iris, &point);
    }
    double value = 0, other = 0;
    int32_t position = 0;
    REQUIRE(rig_optics_f_number(&up, RIG_LEFT, 600, &value) == ERROR_OK);
    CHECK(value == doctest::Approx(4.8));
    REQUIRE(rig_optics_iris_for(&up, RIG_LEFT, 4.8, &position) == ERROR_OK);
    CHECK(position == 600);
    CHECK(rig_optics_iris_for(&up, RIG_LEFT, 16, &position) == ERROR_RANGE);
    // A known distance that was found 6 counts higher than the data sheet says.
    const double nominal = 300 + 550 * 800 / 1800.0;
    REQUIRE(rig_optics_learn_focus(&up, RIG_LEFT, int(std::lround((nominal + 6) * 16)), 8, 1800) ==
            ERROR_OK);
    REQUIRE(rig_optics_distance_at(&up, RIG_LEFT, int(std::lround(nominal + 6)), &value) ==
            ERROR_OK);
    CHECK(value == doctest::Approx(1800).epsilon(0.003));
    REQUIRE(rig_optics_distance_at(&up, RIG_RIGHT, int(std::lround(nominal + 6)), &other) ==
            ERROR_OK);
    CHECK(other < value);
    CHECK(up.camera[RIG_LEFT].lens.focused_us == 1000);
}

TEST_CASE("an iris for a range is the best of all irises, and closes no further than it must") {
    std::mt19937_64 random(synthetic::test_seed());
    const auto draw = [&](double min, double max) {
        return std::uniform_real_distribution<double>(min, max)(random);
    };
    for (int round = 0; round < 300; round++) {
        rig up = made("rig", int(draw(300, 850)), int(draw(400, 700)), int(draw(300, 850)));
        double focus_mm = 0;
        REQUIRE(rig_optics_distance_at(&up, RIG_LEFT,
                                       up.camera[RIG_LEFT].lens.commanded[LENS_FOCUS],
                                       &focus_mm) == ERROR_OK);
        const double near_mm = focus_mm * draw(0.9, 1), far_mm = focus_mm * draw(1, 1.1);
        rig_optics_iris found{};
        const int error = rig_optics_iris_for_range(&up, RIG_LEFT, near_mm, far_mm, &found);
        REQUIRE(error == ERROR_OK);
        CAPTURE(near_mm);
        CAPTURE(far_mm);
        CAPTURE(found.iris);
        // Sharp in all irises from which the ends are within 1 px; the total blur of the others.
        const auto blur = [&](int iris, double *total) {
            up.camera[RIG_LEFT].lens.commanded[LENS_IRIS] = iris;
            double near_px = 0, far_px = 0, diffraction_px = 0;
            REQUIRE(rig_optics_blur_at(&up, RIG_LEFT, near_mm, &near_px, &diffraction_px) ==
                    ERROR_OK);
            REQUIRE(rig_optics_blur_at(&up, RIG_LEFT, far_mm, &far_px, &diffraction_px) ==
                    ERROR_OK);
            const double worse = std::max(near_px, far_px);
            *total = std::hypot(worse, diffraction_px);
            return worse;
        };
        double smallest = INFINITY, total = 0, found_total = 0;
        int first_sharp = 0;
        for (int iris = 850; iris >= 300; iris--) {
            const double worse = blur(iris, &total);
            smallest = std::min(smallest, total);
            first_sharp = first_sharp == 0 && worse <= 1 ? iris : first_sharp;
        }
        const double worse = blur(found.iris, &found_total);
        CHECK(worse == doctest::Approx(found.blur_px));
        if (found.limit == DEPTH_IRIS_NEEDED || found.limit == DEPTH_IRIS_OPEN) {
            CHECK(std::abs(found.iris - first_sharp) <= 1);
        } else {
            CHECK(worse > 1);
            CHECK(found_total < smallest * 1.02);
        }
        if (found.limit == DEPTH_IRIS_CLOSED) {
            CHECK(found.iris == 300);
        }
        if (found.limit == DEPTH_IRIS_OPEN) {
            CHECK(found.iris == 850);
        }
        CHECK(found.best_px <= found.blur_px + 1e-9);
    }
    rig up = made("rig");
    rig_optics_iris found{};
    for (const auto &range :
         {std::pair<double, double>{1850, 1750}, {100, 1800}, {NAN, 1800}, {-1, 5}, {200, 300}}) {
        CHECK(rig_optics_iris_for_range(&up, RIG_LEFT, range.first, range.second, &found) ==
              ERROR_RANGE);
    }
    // Tables that were typed may make no sense.
    lens_table &table = up.camera[RIG_LEFT].lens.learned.iris;
    table.count = 2;
    for (const int closed : {-3000, 0, 500}) {
        table.point[0] = {300, closed, 1, 3};
        table.point[1] = {850, closed > 0 ? 1000 : -1000, 1, 3};
        double ends[2];
        CHECK(rig_optics_iris_ends(&up, RIG_LEFT, &ends[0], &ends[1]) == ERROR_OK);
        CHECK(ends[0] > 0);
        CHECK(ends[1] >= ends[0]);
        const int error = rig_optics_iris_for_range(&up, RIG_LEFT, 1700, 1900, &found);
        CHECK((error == ERROR_OK || error == ERROR_RANGE));
    }
}

TEST_CASE("the iris that would help") {
    rig up = made("rig");
    int32_t iris = 0;
    double diffraction_px = 0;
    REQUIRE(rig_optics_iris_for_reach(&up, RIG_LEFT, 1800, 11, &iris, &diffraction_px) == ERROR_OK);
    double f_number = 0;
    REQUIRE(rig_optics_f_number(&up, RIG_LEFT, iris, &f_number) == ERROR_OK);
    CHECK(f_number == doctest::Approx(8).epsilon(0.02));
    CHECK(diffraction_px == doctest::Approx(2.3).epsilon(0.03));
    CHECK(rig_optics_iris_for_reach(&up, RIG_LEFT, 1800, 100, &iris, &diffraction_px) ==
          ERROR_RANGE);
    CHECK(rig_optics_iris_for_reach(&up, RIG_LEFT, 1800, 0, &iris, &diffraction_px) == ERROR_RANGE);
    REQUIRE(rig_optics_iris_for_reach(&up, RIG_LEFT, 1800, 0.1, &iris, &diffraction_px) ==
            ERROR_OK);
    CHECK(iris == 850);
}

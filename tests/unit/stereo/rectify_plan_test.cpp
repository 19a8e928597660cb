// SPDX-License-Identifier: Apache-2.0
// The frames, windows and disparities that are chosen, and the pairs that are rejected.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "random_rig.hpp"
#include "stereo/geometry/rectify.h"
#include "stereo/match/match.h"
#include "synthetic/seed.hpp"

namespace {

using random_rig::plain_rig;
using random_rig::Random;
using random_rig::uniform;

const rectify_options as_it_is = {0, 0, 1.0, 0, 0, 0, 0, 0, 0, false};
const double infinity = std::numeric_limits<double>::infinity();
const double not_a_number = std::numeric_limits<double>::quiet_NaN();

int make(const calibration &rig, const rectify_options &options, rectify_plan *plan) {
    return rectify_plan_make(&rig, &options, plan);
}

double disparity_of(const rectify_plan &plan, double depth_mm) {
    return plan.f_px * plan.baseline_mm / depth_mm + plan.cx_left_px - plan.cx_right_px;
}

}  // namespace

TEST_CASE("two equal parallel cameras keep their image, size and principal point") {
    const calibration rig = plain_rig();
    rectify_plan plan;
    REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
    CHECK_FALSE(plan.identity);
    CHECK(plan.width_px == 640);
    CHECK(plan.height_px == 480);
    CHECK(plan.f_px == doctest::Approx(600));
    CHECK(plan.cx_left_px == doctest::Approx(319.5));
    CHECK(plan.cx_right_px == doctest::Approx(319.5));
    CHECK(plan.cy_px == doctest::Approx(239.5));
    CHECK(plan.depth_range_assumed);
    CHECK(plan.disparity_min == 0);
    CHECK(plan.disparity_count >= 160);
    CHECK(plan.disparity_count <= 176);
    CHECK(std::isinf(plan.depth_far_mm));
}

TEST_CASE("a verged pair searches around its vergence point, with negative disparities") {
    const double vergence_rad = 0.16;
    const calibration rig = plain_rig(vergence_rad);
    rectify_plan plan;
    REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
    CHECK(plan.depth_range_assumed);
    CHECK(plan.disparity_min < 0);
    const double verged_mm = 100 / std::tan(vergence_rad);  // distance along the left axis
    CHECK(plan.depth_near_mm < verged_mm / 1.4);
    CHECK(plan.depth_far_mm > verged_mm * 1.8);
    CHECK(plan.depth_far_mm < verged_mm * 3);
    // The vergence point is at about the same column in both images: both must show everything that
    // both see.
    CHECK(std::fabs(disparity_of(plan, verged_mm)) < 40);
    CHECK(plan.disparity_count % 16 == 0);
}

TEST_CASE("an assumed range at a long focal length gives way to what can be searched") {
    const calibration rig = plain_rig(0.14, 20000, 250);
    rectify_plan plan;
    REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
    CHECK(plan.disparity_count <= MATCH_MAX_DISPARITIES);
    CHECK(plan.disparity_count > 480);
    const double verged_mm = 250 / std::tan(0.14);
    CHECK(plan.depth_near_mm < verged_mm);
    CHECK(plan.depth_far_mm > verged_mm);
}

TEST_CASE("stated depths: options before calibration, ends inside the search") {
    calibration rig = plain_rig();
    rig.depth_near_mm = 800;
    rig.depth_far_mm = 2000;
    rectify_plan plan;
    REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
    CHECK_FALSE(plan.depth_range_assumed);
    CHECK(plan.depth_near_mm <= 800);
    CHECK(plan.depth_far_mm >= 2000);
    CHECK(plan.disparity_count == 64);  // 75 - 30 px, margins, next multiple of 16
    rectify_options options = as_it_is;
    options.depth_near_mm = 500;
    options.depth_far_mm = infinity;
    REQUIRE(make(rig, options, &plan) == ERROR_OK);
    CHECK(plan.depth_near_mm <= 500);
    CHECK(std::isinf(plan.depth_far_mm));
    // The ends of the plan's depths are the ends of its disparities.
    options.depth_far_mm = 3000;
    REQUIRE(make(rig, options, &plan) == ERROR_OK);
    CHECK(disparity_of(plan, plan.depth_far_mm) == doctest::Approx(plan.disparity_min));
    CHECK(disparity_of(plan, plan.depth_near_mm) ==
          doctest::Approx(plan.disparity_min + plan.disparity_count - 1));
}

TEST_CASE("stated disparities override the depths") {
    const calibration rig = plain_rig();
    rectify_options options = as_it_is;
    options.disparity_min = 10;
    options.disparity_count = 33;
    rectify_plan plan;
    REQUIRE(make(rig, options, &plan) == ERROR_OK);
    CHECK(plan.disparity_min == 10);
    CHECK(plan.disparity_count == 33);
    CHECK_FALSE(plan.depth_range_assumed);
    CHECK(plan.depth_far_mm == doctest::Approx(600 * 100 / 10.0));
    CHECK(plan.depth_near_mm == doctest::Approx(600 * 100 / 42.0));
}

TEST_CASE("a published rectified pair starts at disparity 0 by default") {
    calibration rig = plain_rig();
    rig.rectified = true;
    rig.right.cx_px = 350.5;
    rectify_plan plan;
    REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
    CHECK(plan.identity);
    CHECK(plan.disparity_min == 0);
    CHECK(plan.disparity_count == 176);  // 0..160
    CHECK(plan.depth_far_mm == doctest::Approx(600 * 100 / 31.0));
    CHECK(plan.cx_left_px == 319.5);
    CHECK(plan.cx_right_px == 350.5);
}

TEST_CASE("scale multiplies focal length, size and disparities") {
    const calibration rig = plain_rig(0.16);
    rectify_plan one, two;
    rectify_options options = as_it_is;
    options.depth_near_mm = 400;
    options.depth_far_mm = 1000;
    REQUIRE(make(rig, options, &one) == ERROR_OK);
    options.scale = 2;
    REQUIRE(make(rig, options, &two) == ERROR_OK);
    CHECK(two.f_px == doctest::Approx(2 * one.f_px));
    CHECK(std::abs(two.width_px - 2 * one.width_px) <= 2);
    CHECK(std::abs(two.height_px - 2 * one.height_px) <= 2);
    CHECK(two.disparity_count >= 2 * one.disparity_count - 40);
}

TEST_CASE("a region is a crop of the full plan") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 100; i++) {
        const calibration rig = random_rig::make(random);
        rectify_plan full, part;
        REQUIRE(make(rig, as_it_is, &full) == ERROR_OK);
        rectify_options options = as_it_is;
        options.region_width_px = static_cast<int>(uniform(random, 16, full.width_px));
        options.region_height_px = static_cast<int>(uniform(random, 8, full.height_px));
        options.region_x_px =
            static_cast<int>(uniform(random, 0, full.width_px - options.region_width_px + 1));
        options.region_y_px =
            static_cast<int>(uniform(random, 0, full.height_px - options.region_height_px + 1));
        const int error = make(rig, options, &part);
        CAPTURE(i);
        if (error == ERROR_OVERLAP) {  // a sliver at the border that no match can reach
            CHECK(options.region_width_px < full.disparity_count);
            continue;
        }
        REQUIRE(error == ERROR_OK);
        CHECK(part.width_px == options.region_width_px);
        CHECK(part.height_px == options.region_height_px);
        CHECK(part.cx_left_px == full.cx_left_px - options.region_x_px);
        CHECK(part.cy_px == full.cy_px - options.region_y_px);
        CHECK(part.disparity_count == full.disparity_count);
        CHECK(part.depth_near_mm == doctest::Approx(full.depth_near_mm));
        CHECK(part.depth_far_mm == doctest::Approx(full.depth_far_mm));
        const double moved_px = full.cx_right_px - part.cx_right_px;
        CHECK(moved_px == doctest::Approx(std::round(moved_px)));
        CHECK(moved_px > -0.5);
        CHECK(moved_px < full.width_px - part.width_px + 0.5);
    }
}

TEST_CASE("any orientation of the baseline is a legal rig") {
    struct {
        double centre_mm[3];
        double x_axis[3];  // x axis of the rectified frame, in the left camera's frame
    } const cases[] = {{{100, 0, 0}, {1, 0, 0}},
                       {{0, 100, 0}, {0, 1, 0}},
                       {{0, -100, 0}, {0, -1, 0}},
                       {{-100, 0, 0}, {-1, 0, 0}}};  // swapped: both images turned by 180 degrees
    for (const auto &one : cases) {
        calibration rig = plain_rig();
        random_rig::set_right_centre(&rig, one.centre_mm);
        rectify_plan plan;
        REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
        for (int k = 0; k < 3; k++) {
            CHECK(plan.R_rect_left[k] == doctest::Approx(one.x_axis[k]));
        }
        CHECK(plan.R_rect_left[8] == doctest::Approx(1));
        const bool is_vertical = one.centre_mm[0] == 0;
        CHECK(plan.width_px == (is_vertical ? 480 : 640));
        CHECK(plan.height_px == (is_vertical ? 640 : 480));
        CHECK(plan.disparity_min >= 0);
    }
}

TEST_CASE("what cannot be rectified is refused, with the output untouched") {
    const auto refused = [](const calibration &rig, const rectify_options &options) {
        rectify_plan plan = {};
        plan.width_px = -77;
        const int error = make(rig, options, &plan);
        CHECK((error == ERROR_OK || plan.width_px == -77));
        return error;
    };
    const calibration rig = plain_rig();
    for (double scale : {0.0, -1.0, 4.01, not_a_number, infinity}) {
        rectify_options options = as_it_is;
        options.scale = scale;
        CHECK(refused(rig, options) == ERROR_ARGUMENT);
    }
    struct {
        double near_mm, far_mm;
    } const depths[] = {{500, 500}, {500, 400},          {-1, 500},           {0, 500},
                        {500, 0},   {not_a_number, 500}, {500, not_a_number}, {infinity, infinity}};
    for (const auto &depth : depths) {
        rectify_options options = as_it_is;
        options.depth_near_mm = depth.near_mm;
        options.depth_far_mm = depth.far_mm;
        CHECK(refused(rig, options) == ERROR_DEPTH_RANGE);
    }
    rectify_options options = as_it_is;
    options.scale = 4;
    calibration large = rig;
    large.left.width_px = large.right.width_px = 2000;
    CHECK(refused(large, options) == ERROR_TOO_LARGE);

    // A camera may be larger than what can be matched; only its scaled-down images are rectified.
    for (bool is_left : {true, false}) {
        for (bool is_width : {true, false}) {
            calibration wide = rig;
            lens &one = is_left ? wide.left : wide.right;
            (is_width ? one.width_px : one.height_px) = IMAGE_MAX_SIDE_PX + 1;
            options.scale = 0.25;
            CHECK(refused(wide, options) == ERROR_TOO_LARGE);
        }
    }

    for (int count : {-1, MATCH_MAX_DISPARITIES + 1}) {
        options = as_it_is;
        options.disparity_count = count;
        CHECK(refused(rig, options) == ERROR_DISPARITY_RANGE);
    }
    options = as_it_is;
    options.disparity_count = 16;
    options.disparity_min = -16;  // all of it beyond infinity
    CHECK(refused(rig, options) == ERROR_DISPARITY_RANGE);
    options.disparity_min = MATCH_DISPARITY_LIMIT;
    CHECK(refused(rig, options) == ERROR_DISPARITY_RANGE);

    calibration wide = plain_rig(0, 3000, 1000);
    wide.left.width_px = wide.right.width_px = 4096;
    options = as_it_is;
    options.depth_near_mm = 1000;
    options.depth_far_mm = infinity;
    CHECK(refused(wide, options) == ERROR_DISPARITY_RANGE);

    options = as_it_is;
    options.region_width_px = 641;
    options.region_height_px = 100;
    CHECK(refused(rig, options) == ERROR_ARGUMENT);
    options.region_width_px = 100;
    options.region_x_px = 541;
    CHECK(refused(rig, options) == ERROR_ARGUMENT);
    options.region_x_px = -1;
    CHECK(refused(rig, options) == ERROR_ARGUMENT);
    options.region_x_px = 0;
    options.region_height_px = 0;
    CHECK(refused(rig, options) == ERROR_ARGUMENT);
    options.region_height_px = MATCH_MIN_HEIGHT_PX - 1;
    CHECK(refused(rig, options) == ERROR_TOO_SMALL);

    calibration tiny = rig;
    tiny.left.width_px = tiny.right.width_px = 1;
    tiny.left.height_px = tiny.right.height_px = 1;
    CHECK(refused(tiny, as_it_is) != ERROR_OK);
}

TEST_CASE("depths with equal parallax in double arithmetic are rejected") {
    const calibration rig = plain_rig();
    int refused = 0;
    for (double near_mm = 700; near_mm < 800; near_mm += 1.25) {
        rectify_options options = as_it_is;
        options.depth_near_mm = near_mm;
        options.depth_far_mm = std::nextafter(near_mm, infinity);
        rectify_plan plan;
        const int error = make(rig, options, &plan);
        REQUIRE((error == ERROR_OK || error == ERROR_DEPTH_RANGE));
        refused += error != ERROR_OK;
    }
    CHECK(refused > 0);
}

TEST_CASE("a lens that looks sideways at its border sees no plane") {
    calibration rig = plain_rig(0.1, 1);
    for (lens *one : {&rig.left, &rig.right}) {
        one->width_px = one->height_px = 2100;
        one->cx_px = one->cy_px = 1049.5;
    }
    REQUIRE(lens_validate(&rig.left) == ERROR_OK);
    rectify_plan plan;
    CHECK(make(rig, as_it_is, &plan) == ERROR_OVERLAP);
}

TEST_CASE("a scale that leaves no pixel is refused") {
    calibration rig = plain_rig();
    rig.rectified = true;
    rig.left.width_px = rig.right.width_px = 40;
    rig.depth_near_mm = 1000;
    rig.depth_far_mm = 2000;
    rectify_options options = as_it_is;
    options.scale = 0.01;
    rectify_plan plan;
    CHECK(make(rig, options, &plan) == ERROR_TOO_SMALL);
}

TEST_CASE("views that do not meet are refused") {
    rectify_plan plan;
    CHECK(make(plain_rig(-1.2), as_it_is, &plan) == ERROR_OVERLAP);  // looking apart
    CHECK(make(plain_rig(3.1), as_it_is, &plan) == ERROR_OVERLAP);   // looking at each other
    calibration ahead = plain_rig();
    const double centre_mm[3] = {1, 0, 100};  // one behind the other
    random_rig::set_right_centre(&ahead, centre_mm);
    CHECK(make(ahead, as_it_is, &plan) == ERROR_OVERLAP);
    calibration apart = plain_rig(0, 20000, 100);
    rectify_options options = as_it_is;
    options.depth_near_mm = 500;
    options.depth_far_mm = 600;  // views cross much later
    CHECK(make(apart, options, &plan) == ERROR_OVERLAP);
    calibration up = plain_rig();
    up.rotation_right_left_rad[0] = 1.0;  // one looks up
    random_rig::set_right_centre(&up, centre_mm);
    CHECK(make(up, as_it_is, &plan) == ERROR_OVERLAP);
}

TEST_CASE("tables say when memory is short") {
    const calibration rig = plain_rig(0.1);
    rectify_plan plan;
    REQUIRE(make(rig, as_it_is, &plan) == ERROR_OK);
    const size_t need_bytes = rectify_table_need_bytes(&plan);
    std::vector<unsigned char> memory(need_bytes);
    for (size_t size : {static_cast<size_t>(0), need_bytes / 2, need_bytes - 200}) {
        arena working;
        arena_init(&working, memory.data(), size);
        rectify_table table;
        CHECK(rectify_table_make(&plan, &rig, RECTIFY_LEFT, &working, &table) == ERROR_MEMORY);
        CHECK(working.used_bytes == 0);
    }
}

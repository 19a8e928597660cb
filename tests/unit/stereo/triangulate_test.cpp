// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/triangulate.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/root.h"
#include "random_rig.hpp"
#include "synthetic/seed.hpp"

namespace {

using random_rig::Random;
using random_rig::uniform;

rectify_plan plain_plan() {
    rectify_plan plan = {};
    plan.width_px = 640;
    plan.height_px = 480;
    plan.f_px = plan.fy_px = 500;
    plan.cx_left_px = plan.cx_right_px = 320;
    plan.cy_px = 240;
    plan.baseline_mm = 100;
    for (int i = 0; i < 3; i++) {
        plan.R_rect_left[4 * i] = plan.R_rect_right[4 * i] = 1;
    }
    return plan;
}

rectify_plan random_plan(Random &random) {
    rectify_plan plan = {};
    plan.width_px = 2048;
    plan.height_px = 1536;
    plan.f_px = plan.fy_px = 500 * std::pow(54.0, uniform(random, 0, 1));
    plan.cx_left_px = plan.width_px * uniform(random, 0.2, 0.8);
    plan.cy_px = plan.height_px * uniform(random, 0.2, 0.8);
    plan.cx_right_px = plan.cx_left_px + uniform(random, -3000, 3000);
    plan.baseline_mm = uniform(random, 10, 1000);
    const double r_rad[3] = {uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2),
                             uniform(random, -0.2, 0.2)};
    geometry_rotation_from_vector(r_rad, plan.R_rect_left);
    return plan;
}

// Mid-point of both rays in double precision, left camera's frame.
bool slow_midpoint(const rectify_plan &plan, double x, double y, double disparity_px,
                   double vertical_px, geometry_midpoint *result) {
    const double left[3] = {(x - plan.cx_left_px) / plan.f_px, (y - plan.cy_px) / plan.fy_px, 1};
    const double right[3] = {(x - disparity_px - plan.cx_right_px) / plan.f_px,
                             (y + vertical_px - plan.cy_px) / plan.fy_px, 1};
    const double origin[3] = {}, centre[3] = {plan.baseline_mm, 0, 0};
    geometry_midpoint rect;
    if (!geometry_rays_midpoint(origin, left, centre, right, &rect)) {
        return false;
    }
    *result = rect;
    geometry_rotate_back(plan.R_rect_left, rect.point_mm, result->point_mm);
    return true;
}

triangulate_plan made(const rectify_plan &plan, const triangulate_vertical *vertical) {
    triangulate_plan result;
    REQUIRE(triangulate_plan_make(&plan, vertical, &result) == ERROR_OK);
    return result;
}

}  // namespace

TEST_CASE("a point worked out by hand") {
    const rectify_plan plan = plain_plan();
    const triangulate_plan fixed = made(plan, nullptr);
    // d = 25 px: z = 500 * 100 / 25 = 2000 mm; 100 px right and 50 px up of the centre.
    triangulate_point point;
    REQUIRE(triangulate_match(&fixed, 420, 190, 25 * 256, 64, &point));
    CHECK(point.z_um == 2000000);
    CHECK(std::abs(point.x_um - 400000) <= 1);
    CHECK(std::abs(point.y_um + 200000) <= 1);
    CHECK(point.miss_um == 0);
    // A quarter of a pixel is 1 % of the depth, along a ray of sqrt(1 + 0.04 + 0.01).
    CHECK(point.sigma_um == doctest::Approx(20000 * std::sqrt(1.05)).epsilon(1e-3));
}

TEST_CASE("points are the mid-points of both rays") {
    Random random(synthetic::test_seed());
    int points = 0;
    for (int i = 0; i < 2000; i++) {
        const rectify_plan plan = random_plan(random);
        triangulate_vertical vertical = {};
        vertical.offset_px = std::round(uniform(random, -512, 512)) / 256;
        vertical.samples = 100;
        const triangulate_plan fixed = made(plan, &vertical);
        const int x = static_cast<int>(uniform(random, 0, plan.width_px));
        const int y = static_cast<int>(uniform(random, 0, plan.height_px));
        const auto disparity_q8 = static_cast<int32_t>(
            std::lround(256 * (uniform(random, 30, 600) + plan.cx_left_px - plan.cx_right_px)));
        triangulate_point point;
        geometry_midpoint slow;
        if (!triangulate_match(&fixed, x, y, disparity_q8, 10, &point)) {
            continue;
        }
        REQUIRE(slow_midpoint(plan, x, y, disparity_q8 / 256.0, vertical.offset_px, &slow));
        points++;
        const double away_um =
            std::hypot(1e3 * slow.point_mm[0] - point.x_um, 1e3 * slow.point_mm[1] - point.y_um,
                       1e3 * slow.point_mm[2] - point.z_um);
        REQUIRE(away_um <= 2 + 1e-6 * 1e3 * geometry_norm(slow.point_mm));
        const double miss_um = 1e3 * slow.miss_mm;
        REQUIRE(std::fabs(point.miss_um - miss_um) <= 1.5 + 1e-4 * miss_um);
    }
    CHECK(points > 1500);
}

TEST_CASE("sigma is what the point moves when the disparity does") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 2000; i++) {
        const rectify_plan plan = random_plan(random);
        const triangulate_plan fixed = made(plan, nullptr);
        const int x = static_cast<int>(uniform(random, 0, plan.width_px));
        const int y = static_cast<int>(uniform(random, 0, plan.height_px));
        const double parallax_px = uniform(random, 20, 1000);
        const int32_t disparity_q8 = static_cast<int32_t>(
            std::lround(256 * (parallax_px + plan.cx_left_px - plan.cx_right_px)));
        triangulate_point point;
        if (!triangulate_match(&fixed, x, y, disparity_q8, 26, &point)) {
            continue;
        }
        geometry_midpoint less, more;
        const double step_px = 26 / 256.0;
        REQUIRE(slow_midpoint(plan, x, y, disparity_q8 / 256.0 - step_px, 0, &less));
        REQUIRE(slow_midpoint(plan, x, y, disparity_q8 / 256.0 + step_px, 0, &more));
        const double moved_um = 500 * std::hypot(less.point_mm[0] - more.point_mm[0],
                                                 less.point_mm[1] - more.point_mm[1],
                                                 less.point_mm[2] - more.point_mm[2]);
        REQUIRE(point.sigma_um == doctest::Approx(moved_um).epsilon(2e-3).scale(1000));
    }
}

TEST_CASE("a scatter of the vertical residual counts off the axes, and only there") {
    const rectify_plan plan = plain_plan();
    triangulate_vertical vertical = {};
    vertical.rms_px = 0.5;
    vertical.samples = 100;
    const triangulate_plan fixed = made(plan, &vertical);
    for (int x : {0, 320, 639}) {
        for (int y : {0, 240, 479}) {
            triangulate_point point;
            const double disparity_px = 25;
            REQUIRE(triangulate_match(&fixed, x, y, 25 * 256, 13, &point));
            geometry_midpoint less, more;
            const double step_px = 0.01;
            REQUIRE(slow_midpoint(plan, x, y, disparity_px, -step_px, &less));
            REQUIRE(slow_midpoint(plan, x, y, disparity_px, step_px, &more));
            const double ray = std::hypot((x - 320) / 500.0, (y - 240) / 500.0, 1.0);
            const double along_um = 2e6 * 13 / 256 / disparity_px * ray;
            const double across_um =
                1e3 * (more.point_mm[2] - less.point_mm[2]) / (2 * step_px) * 0.5 * ray;
            CAPTURE(x);
            CAPTURE(y);
            // The left ray's x is used for the mean of both: an error of a few percent where D is
            // not small.
            CHECK(point.sigma_um == doctest::Approx(std::hypot(along_um, across_um)).epsilon(0.04));
            CHECK((std::fabs(across_um) > 1000) == (x != 320 && y != 240));
        }
    }
}

TEST_CASE("no point where the rays do not meet in front of the cameras") {
    const rectify_plan plan = plain_plan();
    triangulate_vertical vertical = {};
    vertical.offset_px = 3;
    vertical.samples = 100;
    const triangulate_plan fixed = made(plan, nullptr), skew = made(plan, &vertical);
    triangulate_point point = {};
    point.z_um = 42;
    CHECK_FALSE(triangulate_match(&fixed, 320, 240, 0, 10, &point));
    CHECK_FALSE(triangulate_match(&fixed, 320, 240, -256, 10, &point));
    CHECK_FALSE(triangulate_match(&fixed, 320, 240, INT32_MIN, 10, &point));
    CHECK_FALSE(triangulate_match(&fixed, 320, 240, 6, 10, &point));  // 2133 m
    CHECK_FALSE(triangulate_match(&skew, 320, 240, 2 * 256, 10, &point));
    CHECK(point.z_um == 42);
    CHECK(triangulate_match(&fixed, 320, 240, 7, 10, &point));  // 1829 m
    CHECK(triangulate_match(&skew, 320, 240, 4 * 256, 10, &point));
    CHECK(point.miss_um > 0);
    CHECK(triangulate_match(&fixed, 320, 240, INT32_MAX, UINT32_MAX, &point));
}

TEST_CASE("values that do not fit are refused") {
    triangulate_plan result;
    const auto check = [&result](double rectify_plan::*field, double value) {
        rectify_plan plan = plain_plan();
        plan.*field = value;
        return triangulate_plan_make(&plan, nullptr, &result);
    };
    CHECK(check(&rectify_plan::baseline_mm, 1e5) == ERROR_OK);
    CHECK(check(&rectify_plan::baseline_mm, 1.1e5) == ERROR_RANGE);
    CHECK(check(&rectify_plan::baseline_mm, 0) == ERROR_RANGE);
    CHECK(check(&rectify_plan::f_px, 1.1e6) == ERROR_RANGE);
    CHECK(check(&rectify_plan::fy_px, 0.5) == ERROR_RANGE);
    CHECK(check(&rectify_plan::f_px, 30) == ERROR_RANGE);  // slopes above 8
    CHECK(check(&rectify_plan::cy_px, std::nan("")) == ERROR_RANGE);
    const rectify_plan plan = plain_plan();
    for (double offset_px : {257.0, -257.0, std::nan("")}) {
        triangulate_vertical vertical = {};
        vertical.samples = 1;
        vertical.offset_px = offset_px;
        CHECK(triangulate_plan_make(&plan, &vertical, &result) == ERROR_RANGE);
    }
    triangulate_vertical unmeasured = {};
    unmeasured.offset_px = std::nan("");
    CHECK(triangulate_plan_make(&plan, &unmeasured, &result) == ERROR_OK);
}

TEST_CASE("disparities that are certainly within a range of depths") {
    Random random(synthetic::test_seed());
    double all_px = 0, certain_px = 0;
    for (int i = 0; i < 3000; i++) {
        const rectify_plan plan = random_plan(random);
        triangulate_vertical vertical = {};
        vertical.offset_px = uniform(random, -3, 3);
        vertical.slope_x = uniform(random, -0.002, 0.002);
        vertical.slope_y = uniform(random, -0.002, 0.002);
        vertical.samples = i % 2;
        triangulate_plan fixed;
        REQUIRE(triangulate_plan_make(&plan, &vertical, &fixed) == ERROR_OK);
        const auto near_um = static_cast<int32_t>(1e5 * std::pow(100, uniform(random, 0, 1)));
        const int32_t far_um = i % 5 == 0 ? INT32_MAX : 2 * near_um;
        const triangulate_certain certain =
            triangulate_find_certain(&plan, &fixed, near_um, far_um);
        if (far_um != INT32_MAX) {
            all_px += plan.f_px * plan.baseline_mm * (1e3 / near_um - 1e3 / far_um);
        }
        if (certain.most_q8 < certain.least_q8) {
            continue;
        }
        if (far_um != INT32_MAX) {
            certain_px += (certain.most_q8 - certain.least_q8) / 256.0;
        }
        for (int k = 0; k < 50; k++) {
            const double part[3] = {0, 1, uniform(random, 0, 1)};
            const double x = plan.width_px * part[k % 3], y = plan.height_px * part[k / 3 % 3];
            const double most = static_cast<double>(certain.most_q8) - certain.least_q8;
            const auto disparity_q8 =
                static_cast<int32_t>(std::lround(certain.least_q8 + most * part[k / 9 % 3]));
            triangulate_point point;
            REQUIRE(triangulate_match(&fixed, static_cast<int>(x), static_cast<int>(y),
                                      disparity_q8, 10, &point));
            REQUIRE(point.z_um >= near_um);
            REQUIRE(point.z_um <= far_um);
        }
    }
    MESSAGE((certain_px / all_px) << " of the disparities");
    CHECK(certain_px > 0.3 * all_px);
}

TEST_CASE("nothing overflows over all legal values") {
    Random random(synthetic::test_seed());
    int points = 0;
    for (int i = 0; i < 4000; i++) {
        rectify_plan plan = {};
        plan.width_px = static_cast<int>(uniform(random, 1, 4097));
        plan.height_px = static_cast<int>(uniform(random, 1, 4097));
        plan.f_px = std::pow(10, uniform(random, 0, 6));
        plan.fy_px = std::min(1e6, std::max(1.0, plan.f_px * std::pow(10, uniform(random, -1, 1))));
        plan.cx_left_px = plan.width_px * uniform(random, -2, 3);
        plan.cy_px = plan.height_px * uniform(random, -2, 3);
        plan.cx_right_px = plan.cx_left_px + uniform(random, -1e6, 1e6);
        plan.baseline_mm = std::pow(10, uniform(random, -3, 5));
        const double r_rad[3] = {uniform(random, -3, 3), uniform(random, -3, 3),
                                 uniform(random, -3, 3)};
        geometry_rotation_from_vector(r_rad, plan.R_rect_left);
        triangulate_vertical vertical = {};
        vertical.offset_px = uniform(random, -256, 256);
        vertical.slope_x = uniform(random, -0.25, 0.25);
        vertical.slope_y = uniform(random, -0.25, 0.25);
        vertical.rms_px = uniform(random, 0, 256);
        vertical.samples = i % 3;
        triangulate_plan fixed;
        if (triangulate_plan_make(&plan, &vertical, &fixed) != ERROR_OK) {
            continue;
        }
        for (int k = 0; k < 50; k++) {
            const double parallax_px =
                uniform(random, -1, 100) * std::pow(10, uniform(random, -4, 4));
            const double disparity = 256 * (parallax_px + plan.cx_left_px - plan.cx_right_px);
            const int32_t disparity_q8 =
                k % 5 == 0 ? static_cast<int32_t>(random())
                           : static_cast<int32_t>(std::max(-2e9, std::min(2e9, disparity)));
            triangulate_point point;
            if (triangulate_match(&fixed, static_cast<int>(uniform(random, 0, plan.width_px)),
                                  static_cast<int>(uniform(random, 0, plan.height_px)),
                                  disparity_q8, static_cast<uint32_t>(random()) >> (k % 32),
                                  &point)) {
                points++;
                for (int32_t c : {point.x_um, point.y_um, point.z_um}) {
                    REQUIRE(std::abs(static_cast<double>(c)) <= 2e9);
                }
            }
        }
    }
    MESSAGE(points << " points");
    CHECK(points > 10000);
}

TEST_CASE("integer roots") {
    Random random(synthetic::test_seed());
    CHECK(root_of(0) == 0);
    for (int64_t value = 1; value < 100000; value++) {
        REQUIRE(std::fabs(static_cast<double>(root_of(value)) -
                          std::floor(std::sqrt(static_cast<double>(value)))) <= 1);
    }
    for (int i = 0; i < 200000; i++) {
        const int64_t value = static_cast<int64_t>(random() >> 2 >> (random() % 60)) | 1;
        const double truth = std::sqrt(static_cast<double>(value));
        REQUIRE(std::fabs(static_cast<double>(root_of(value)) - truth) <= 1 + truth * 0x1p-27);
        int shift;
        const uint32_t m_q30 = root_normalise(value, &shift);
        REQUIRE(m_q30 >= 1u << 30);
        REQUIRE(shift % 2 == 0);
        const double inverse = root_inverse_q30(m_q30) / 0x1p30;
        REQUIRE(std::fabs(inverse * std::sqrt(m_q30 / 0x1p30) - 1) < 0x1p-27);
    }
}

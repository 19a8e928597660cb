// SPDX-License-Identifier: Apache-2.0
// Triangulation compared with a brute-force optimum in long double and with OpenCV.
#include "stereo/geometry/triangulate.h"

#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "core/error.h"
#include "random_rig.hpp"
#include "synthetic/seed.hpp"

namespace {

using random_rig::Random;
using random_rig::uniform;

struct Point {
    long double x, y, z;
};

Point at(const Point &origin, const Point &direction, long double s) {
    return {origin.x + s * direction.x, origin.y + s * direction.y, origin.z + s * direction.z};
}

long double distance2(const Point &a, const Point &b) {
    return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) + (a.z - b.z) * (a.z - b.z);
}

// Minimum of a convex function in [low, high], by golden section.
template <typename Function>
long double minimise(long double low, long double high, Function f) {
    const long double golden = (std::sqrt(5.0L) - 1) / 2;
    long double a = high - golden * (high - low), b = low + golden * (high - low);
    long double fa = f(a), fb = f(b);
    for (int i = 0; i < 120; i++) {
        if (fa < fb) {
            high = b, b = a, fb = fa;
            a = high - golden * (high - low), fa = f(a);
        } else {
            low = a, a = b, fa = fb;
            b = low + golden * (high - low), fb = f(b);
        }
    }
    return (low + high) / 2;
}

struct Optimum {
    Point point;
    long double miss;
};

// Searches both rays for their closest points, using only the formula of a distance.
Optimum search(const Point &centre, const Point &left, const Point &right, long double scale) {
    const Point origin = {0, 0, 0};
    const auto nearest_right = [&](const Point &p) {
        return minimise(0, 4 * scale,
                        [&](long double t) { return distance2(p, at(centre, right, t)); });
    };
    const long double s = minimise(0, 4 * scale, [&](long double candidate) {
        const Point p = at(origin, left, candidate);
        return distance2(p, at(centre, right, nearest_right(p)));
    });
    const Point p = at(origin, left, s);
    const Point q = at(centre, right, nearest_right(p));
    return {{(p.x + q.x) / 2, (p.y + q.y) / 2, (p.z + q.z) / 2}, std::sqrt(distance2(p, q))};
}

}  // namespace

TEST_CASE("mid-points against a brute-force search in long double") {
    Random random(synthetic::test_seed());
    INFO("seed " << synthetic::test_seed());
    double max = 0, max_miss = 0;
    int points = 0;
    for (int i = 0; i < 120; i++) {
        rectify_plan plan = {};
        plan.width_px = 2048;
        plan.height_px = 1536;
        plan.f_px = plan.fy_px = 500 * std::pow(54.0, uniform(random, 0, 1));
        plan.cx_left_px = 1000;
        plan.cy_px = 750;
        plan.cx_right_px = 1000 + std::round(uniform(random, -2000, 2000));
        plan.baseline_mm = uniform(random, 50, 500);
        for (int k = 0; k < 3; k++) {
            plan.R_rect_left[4 * k] = 1;
        }
        triangulate_vertical vertical = {};
        vertical.offset_px = std::round(uniform(random, -512, 512)) / 256;
        vertical.samples = 100;
        triangulate_plan fixed;
        REQUIRE(triangulate_plan_make(&plan, &vertical, &fixed) == ERROR_OK);
        const int x = static_cast<int>(uniform(random, 0, 2048));
        const int y = static_cast<int>(uniform(random, 0, 1536));
        const double parallax_px = std::round(256 * uniform(random, 30, 600)) / 256;
        triangulate_point point;
        const double disparity = 256 * (parallax_px + plan.cx_left_px - plan.cx_right_px);
        if (!triangulate_match(&fixed, x, y, static_cast<int32_t>(std::lround(disparity)), 10,
                               &point)) {
            continue;
        }
        points++;
        const long double f = plan.f_px;
        const Point left = {(x - plan.cx_left_px) / f, (y - plan.cy_px) / f, 1};
        const Point right = {left.x - parallax_px / f, left.y + vertical.offset_px / f, 1};
        const Point centre = {1e3L * plan.baseline_mm, 0, 0};
        const long double plain_um = 1e3L * plan.f_px * plan.baseline_mm / parallax_px;
        const Optimum truth = search(centre, left, right, plain_um);
        const Point ours = {static_cast<long double>(point.x_um),
                            static_cast<long double>(point.y_um),
                            static_cast<long double>(point.z_um)};
        // The search itself is accurate to about 1e-9 of the depth (the root of a long double's
        // precision).
        const long double bound_um = 1.5L + 3e-7L * plain_um;
        max =
            std::max(max, static_cast<double>(std::sqrt(distance2(ours, truth.point)) / bound_um));
        max_miss = std::max(
            max_miss,
            static_cast<double>(std::fabs(static_cast<long double>(point.miss_um) - truth.miss) /
                                (1.5L + 1e-4L * truth.miss)));
    }
    MESSAGE(points << " points, worst " << max << " of the bound, miss " << max_miss);
    CHECK(points > 100);
    CHECK(max <= 1);
    CHECK(max_miss <= 1);
}

// Without a residual every sensible method gives the same point.
TEST_CASE("points against cv::triangulatePoints in the raw cameras") {
    Random random(synthetic::test_seed());
    INFO("seed " << synthetic::test_seed());
    const rectify_options as_it_is = {0, 0, 1.0, 0, 0, 0, 0, 0, 0, false};
    double max = 0;
    for (int i = 0; i < 100; i++) {
        const calibration rig = random_rig::make(random);
        rectify_plan plan;
        REQUIRE(rectify_plan_make(&rig, &as_it_is, &plan) == ERROR_OK);
        triangulate_plan fixed;
        REQUIRE(triangulate_plan_make(&plan, nullptr, &fixed) == ERROR_OK);
        cv::Mat R, P_right(3, 4, CV_64F);
        cv::Rodrigues(cv::Mat(3, 1, CV_64F, const_cast<double *>(rig.rotation_right_left_rad)), R);
        R.copyTo(P_right.colRange(0, 3));
        cv::Mat(3, 1, CV_64F, const_cast<double *>(rig.translation_right_left_mm))
            .copyTo(P_right.col(3));
        const cv::Mat P_left = cv::Mat::eye(3, 4, CV_64F);
        const int x = static_cast<int>(uniform(random, 0, plan.width_px));
        const int y = static_cast<int>(uniform(random, 0, plan.height_px));
        const int d = plan.disparity_min + plan.disparity_count / 2;
        triangulate_point point;
        REQUIRE(triangulate_match(&fixed, x, y, 256 * d, 10, &point));
        const auto ray = [&](const double R_rect_camera[9], double cx_px, double column) {
            const double rect[3] = {(column - cx_px) / plan.f_px, (y - plan.cy_px) / plan.fy_px, 1};
            double camera[3];
            geometry_rotate_back(R_rect_camera, rect, camera);
            cv::Mat slopes(2, 1, CV_64F);
            slopes.at<double>(0) = camera[0] / camera[2];
            slopes.at<double>(1) = camera[1] / camera[2];
            return slopes;
        };
        cv::Mat homogeneous;
        cv::triangulatePoints(P_left, P_right, ray(plan.R_rect_left, plan.cx_left_px, x),
                              ray(plan.R_rect_right, plan.cx_right_px, x - d), homogeneous);
        double away_um = 0, range_um = 0;
        const int32_t ours_um[3] = {point.x_um, point.y_um, point.z_um};
        for (int k = 0; k < 3; k++) {
            const double theirs_um = 1e3 * homogeneous.at<double>(k) / homogeneous.at<double>(3);
            away_um = std::hypot(away_um, theirs_um - ours_um[k]);
            range_um = std::hypot(range_um, theirs_um);
        }
        max = std::max(max, away_um / (2 + 1e-6 * range_um));
    }
    MESSAGE("worst " << max << " of 2 um + 1e-6 of the range");
    CHECK(max <= 1);
}

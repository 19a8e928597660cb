// SPDX-License-Identifier: Apache-2.0
// Rectified coordinates and pixels compared with OpenCV's.
#include "stereo/geometry/rectify.h"

#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "oracle/stereo_rig.hpp"
#include "random_rig.hpp"
#include "stereo/geometry/geometry.h"
#include "synthetic/seed.hpp"

namespace {

using namespace stereo_rig;
using random_rig::uniform;

const rectify_options as_it_is = {0, 0, 1.0, 0, 0, 0, 0, 0, 0, false};

// Largest difference in px between our coordinates and OpenCV's float maps, inside the raw image.
double compare_maps(const rectify_plan &plan, const calibration &rig, rectify_side side,
                    int row_step) {
    const lens &lens = side == RECTIFY_LEFT ? rig.left : rig.right;
    cv::Mat map_x, map_y;
    cv::initUndistortRectifyMap(
        camera_matrix(lens), coefficients(lens),
        rotation(side == RECTIFY_LEFT ? plan.R_rect_left : plan.R_rect_right),
        rectified_matrix(plan, side), cv::Size(plan.width_px, plan.height_px), CV_32FC1, map_x,
        map_y);
    const Table table(plan, rig, side);
    std::vector<int32_t> x_q16(static_cast<size_t>(plan.width_px)), y_q16(x_q16);
    double max_px = 0;
    for (int y = 0; y < plan.height_px; y += row_step) {
        rectify_row_coordinates(&table.table, y, x_q16.data(), y_q16.data());
        for (int x = 0; x < plan.width_px; x++) {
            const double their_x = map_x.at<float>(y, x), their_y = map_y.at<float>(y, x);
            if (their_x >= 0 && their_y >= 0 && their_x <= lens.width_px - 1 &&
                their_y <= lens.height_px - 1) {
                const size_t i = static_cast<size_t>(x);
                max_px = std::max({max_px, std::fabs(x_q16[i] / 65536.0 - their_x),
                                   std::fabs(y_q16[i] / 65536.0 - their_y)});
            }
        }
    }
    return max_px;
}

}  // namespace

TEST_CASE("coordinates on 200 random rigs, f to 27,000 px, vergence to 10 degrees") {
    random_rig::Random random(synthetic::test_seed());
    double max_px = 0, longest_px = 0;
    for (int i = 0; i < 200; i++) {
        const calibration rig = random_rig::make(random, 2048, 1536);
        rectify_plan plan;
        REQUIRE(rectify_plan_make(&rig, &as_it_is, &plan) == ERROR_OK);
        longest_px = std::max(longest_px, plan.f_px);
        for (rectify_side side : {RECTIFY_LEFT, RECTIFY_RIGHT}) {
            const double px = compare_maps(plan, rig, side, 37);
            CAPTURE(i);
            CHECK(px < 0.02);
            max_px = std::max(max_px, px);
        }
    }
    MESSAGE("worst difference " << max_px << " px, longest focal length " << longest_px << " px");
    CHECK(longest_px > 20000);
}

namespace {

// A rig of two lenses whose distortion folds over near their corners.
calibration folding_rig(const lens &left, const lens &right) {
    calibration rig = {};
    rig.left = left;
    rig.right = right;
    rig.rotation_right_left_rad[0] = 0.004;
    rig.rotation_right_left_rad[1] = 0.01;
    rig.rotation_right_left_rad[2] = -0.006;
    const double centre_mm[3] = {120, 1, -2};
    random_rig::set_right_centre(&rig, centre_mm);
    rig.depth_near_mm = 1500;
    rig.depth_far_mm = INFINITY;
    return rig;
}

std::vector<calibration> folding_rigs(random_rig::Random &random) {
    // Values stated by the raw KITTI recordings for their colour cameras, and by OpenCV's own
    // sample for a left camera.
    const lens kitti_02 = {1392,        512,        959.7910,  956.9251,    696.0217,
                           224.1806,    -0.3691481, 0.1968681, 0.001353473, 0.0005677587,
                           -0.06770705, 0,          0,         0,           LENS_BROWN_CONRADY};
    const lens kitti_03 = {
        1392,       512,       903.7596,          901.9653,      695.7519,    224.2509,
        -0.3639558, 0.1788651, 0.0006029694,      -0.0003922424, -0.05382460, 0,
        0,          0,         LENS_BROWN_CONRADY};
    const lens sample = {640,
                         480,
                         534.80326845051309,
                         534.80326845051309,
                         319.5,
                         239.5,
                         0.29589439552724328,
                         -1.0354662043042675,
                         0,
                         0,
                         0,
                         0,
                         0,
                         0,
                         LENS_BROWN_CONRADY};
    std::vector<calibration> rigs = {folding_rig(kitti_02, kitti_03), folding_rig(sample, sample)};
    for (int i = 0; i < 40; i++) {
        lens made[2] = {};
        for (lens &one : made) {
            one.width_px = 640;
            one.height_px = 480;
            one.fx_px = one.fy_px = uniform(random, 300, 1500);
            one.cx_px = uniform(random, 300, 340);
            one.cy_px = uniform(random, 220, 260);
            // Folds over between 0.65 and 0.95 of the corners' radius, for k1 alone.
            const double rim = uniform(random, 0.65, 0.95) * 400 / one.fx_px * 1.5;
            one.k1 = -1 / (3 * rim * rim);
            one.k2 = uniform(random, -0.03, 0.03) / std::pow(rim, 4);
            one.p1 = uniform(random, -0.004, 0.004);
            one.p2 = uniform(random, -0.004, 0.004);
        }
        rigs.push_back(folding_rig(made[0], made[1]));
    }
    return rigs;
}

}  // namespace

TEST_CASE("lenses that fold over near the corners: right up to the rim, nothing behind it") {
    random_rig::Random random(synthetic::test_seed());
    double max_px = 0, min_rim = 1;
    int ghosts = 0, rims = 0;
    for (const calibration &rig : folding_rigs(random)) {
        REQUIRE(lens_validate(&rig.left) == ERROR_OK);
        REQUIRE(lens_validate(&rig.right) == ERROR_OK);
        rectify_plan plan;
        REQUIRE(rectify_plan_make(&rig, &as_it_is, &plan) == ERROR_OK);
        for (rectify_side side : {RECTIFY_LEFT, RECTIFY_RIGHT}) {
            const lens &lens = side == RECTIFY_LEFT ? rig.left : rig.right;
            const double *R = side == RECTIFY_LEFT ? plan.R_rect_left : plan.R_rect_right;
            const double cx_px = side == RECTIFY_LEFT ? plan.cx_left_px : plan.cx_right_px;
            cv::Mat map_x, map_y;
            cv::initUndistortRectifyMap(
                camera_matrix(lens), coefficients(lens), rotation(R), rectified_matrix(plan, side),
                cv::Size(plan.width_px, plan.height_px), CV_32FC1, map_x, map_y);
            const Table table(plan, rig, side);
            REQUIRE(table.table.view != nullptr);
            std::vector<rectify_span> spans;
            const cv::Mat white(lens.height_px, lens.width_px, CV_8U, cv::Scalar(255));
            const cv::Mat seen = rectified(table.table, white, &spans);
            std::vector<int32_t> x_q16(static_cast<size_t>(plan.width_px)), y_q16(x_q16);
            for (int y = 0; y < plan.height_px; y++) {
                const rectify_span view = table.table.view[y], span = spans[static_cast<size_t>(y)];
                REQUIRE(
                    (span.begin == span.end || (span.begin >= view.begin && span.end <= view.end)));
                rectify_row_coordinates(&table.table, y, x_q16.data(), y_q16.data());
                for (int x = 0; x < plan.width_px; x++) {
                    const size_t i = static_cast<size_t>(x);
                    const double their_x = map_x.at<float>(y, x), their_y = map_y.at<float>(y, x);
                    const bool in_view = x >= view.begin && x < view.end;
                    const bool in_image = their_x > 0.1 && their_y > 0.1 &&
                                          their_x < lens.width_px - 1.1 &&
                                          their_y < lens.height_px - 1.1;
                    REQUIRE(seen.at<uint8_t>(y, x) == (x >= span.begin && x < span.end ? 255 : 0));
                    ghosts += in_image && !in_view;  // OpenCV shows the corners a second time
                    if (in_view && in_image) {
                        max_px = std::max({max_px, std::fabs(x_q16[i] / 65536.0 - their_x),
                                           std::fabs(y_q16[i] / 65536.0 - their_y)});
                    }
                }
                for (int x :
                     {view.begin - 1, static_cast<int>(view.end)}) {  // just outside the rim
                    if (view.begin == view.end || x < 0 || x >= plan.width_px) {
                        continue;
                    }
                    const double ray_rect[3] = {(x - cx_px) / plan.f_px,
                                                (y - plan.cy_px) / plan.fy_px, 1};
                    double ray[3];
                    geometry_rotate_back(R, ray_rect, ray);
                    min_rim = std::min(
                        min_rim, std::hypot(ray[0], ray[1]) / ray[2] / lens_fold_radius(&lens));
                    rims++;
                }
            }
        }
    }
    MESSAGE("worst difference " << max_px << " px; " << ghosts
                                << " pixels left out that OpenCV fills; the rim lies at " << min_rim
                                << " of the fold or more");
    CHECK(max_px < 0.02);
    CHECK(ghosts > 1000);
    CHECK(rims > 1000);
    CHECK(min_rim > 0.9);
}

// cv::remap rounds coordinates to 1/32 px: the difference is reported, and limited to what such
// rounding explains.
TEST_CASE("pixels against cv::remap") {
    const std::vector<BoardPair> pairs = recorded_pairs();
    const calibration rig = calibrate(pairs);
    rectify_plan plan;
    REQUIRE(rectify_plan_make(&rig, &as_it_is, &plan) == ERROR_OK);
    for (rectify_side side : {RECTIFY_LEFT, RECTIFY_RIGHT}) {
        const bool is_left = side == RECTIFY_LEFT;
        const lens &lens = is_left ? rig.left : rig.right;
        const Table table(plan, rig, side);
        cv::Mat map_x, map_y, theirs;
        cv::initUndistortRectifyMap(
            camera_matrix(lens), coefficients(lens),
            rotation(is_left ? plan.R_rect_left : plan.R_rect_right), rectified_matrix(plan, side),
            cv::Size(plan.width_px, plan.height_px), CV_32FC1, map_x, map_y);
        double sum = 0, beyond_one = 0, count = 0;
        int max = 0;
        for (const BoardPair &pair : pairs) {
            const cv::Mat &raw = pair.image[is_left ? 0 : 1];
            std::vector<rectify_span> spans;
            const cv::Mat ours = rectified(table.table, raw, &spans);
            cv::remap(raw, theirs, map_x, map_y, cv::INTER_LINEAR);
            for (int y = 0; y < ours.rows; y++) {
                for (int x = spans[static_cast<size_t>(y)].begin;
                     x < spans[static_cast<size_t>(y)].end; x++) {
                    if (map_x.at<float>(y, x) < 1 || map_y.at<float>(y, x) < 1 ||
                        map_x.at<float>(y, x) > static_cast<float>(lens.width_px - 2) ||
                        map_y.at<float>(y, x) > static_cast<float>(lens.height_px - 2)) {
                        continue;  // OpenCV blends the border with black
                    }
                    const int difference =
                        std::abs(ours.at<uint8_t>(y, x) - theirs.at<uint8_t>(y, x));
                    max = std::max(max, difference);
                    sum += difference;
                    beyond_one += difference > 1;
                    count++;
                }
            }
        }
        MESSAGE(std::string(is_left ? "left" : "right")
                << ": mean difference " << sum / count << " grey levels, largest " << max << ", "
                << 100 * beyond_one / count << " % of pixels differ by more than one");
        CHECK(sum / count < 0.5);
        CHECK(max <= 1 + 2 * 255 / 64);  // half a 32nd of a pixel in x and in y, full contrast
    }
}

TEST_CASE("rational and equidistant lenses against OpenCV's projections") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 100; i++) {
        lens wide{};
        wide.width_px = 640, wide.height_px = 480;
        wide.fx_px = uniform(random, 200, 600), wide.fy_px = uniform(random, 200, 600);
        wide.cx_px = 322, wide.cy_px = 238;
        wide.kind = i % 2 == 0 ? LENS_EQUIDISTANT : LENS_RATIONAL;
        const double strength = i % 2 == 0 ? 0.05 : 0.3;
        for (double lens::*k : {&lens::k1, &lens::k2, &lens::k3, &lens::k4}) {
            wide.*k = uniform(random, 0, strength);
        }
        if (wide.kind == LENS_RATIONAL) {
            wide.k5 = uniform(random, 0, 0.3), wide.k6 = uniform(random, 0, 0.1);
            wide.p1 = uniform(random, -1e-3, 1e-3), wide.p2 = uniform(random, -1e-3, 1e-3);
        }
        std::vector<cv::Point3d> points;
        for (int k = 0; k < 50; k++) {
            points.push_back({uniform(random, -3, 3), uniform(random, -3, 3), 1});
        }
        const cv::Matx33d K(wide.fx_px, 0, wide.cx_px, 0, wide.fy_px, wide.cy_px, 0, 0, 1);
        const cv::Vec3d none(0, 0, 0);
        std::vector<cv::Point2d> theirs;
        if (wide.kind == LENS_EQUIDISTANT) {
            cv::fisheye::projectPoints(points, theirs, none, none, K,
                                       cv::Vec4d(wide.k1, wide.k2, wide.k3, wide.k4));
        } else {
            const std::vector<double> D = {wide.k1, wide.k2, wide.p1, wide.p2,
                                           wide.k3, wide.k4, wide.k5, wide.k6};
            cv::projectPoints(points, none, none, K, D, theirs);
        }
        for (size_t k = 0; k < points.size(); k++) {
            const double point_mm[3] = {points[k].x, points[k].y, points[k].z};
            double pixel_px[2];
            REQUIRE(lens_project(&wide, point_mm, pixel_px));
            const double size_px = 1 + std::hypot(theirs[k].x, theirs[k].y);
            REQUIRE(std::hypot(pixel_px[0] - theirs[k].x, pixel_px[1] - theirs[k].y) <
                    1e-10 * size_px);
        }
    }
}

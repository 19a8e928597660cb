// SPDX-License-Identifier: Apache-2.0
// Rectified coordinates and pixels against OpenCV's.
#include "core/rectify.h"

#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "oracle/stereo_rig.hpp"
#include "random_rig.hpp"
#include "synthetic/seed.hpp"

namespace {

using namespace stereo_rig;

const rectify_options as_it_is = {0, 0, 1.0, 0, 0, 0, 0, 0, 0};

// Worst difference in px of our coordinates to OpenCV's float maps, inside the raw image.
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
    double most_px = 0;
    for (int y = 0; y < plan.height_px; y += row_step) {
        rectify_row_coordinates(&table.table, y, x_q16.data(), y_q16.data());
        for (int x = 0; x < plan.width_px; x++) {
            const double their_x = map_x.at<float>(y, x), their_y = map_y.at<float>(y, x);
            if (their_x >= 0 && their_y >= 0 && their_x <= lens.width_px - 1 &&
                their_y <= lens.height_px - 1) {
                const size_t i = static_cast<size_t>(x);
                most_px = std::max({most_px, std::fabs(x_q16[i] / 65536.0 - their_x),
                                    std::fabs(y_q16[i] / 65536.0 - their_y)});
            }
        }
    }
    return most_px;
}

}  // namespace

TEST_CASE("coordinates on the recorded chessboard rig") {
    const calibration rig = calibrate(recorded_pairs());
    REQUIRE(calibration_validate(&rig, nullptr) == ERROR_OK);
    for (double scale : {0.15, 0.25, 0.37, 0.5, 0.7, 1.0, 2.0}) {
        rectify_options options = as_it_is;
        options.scale = scale;
        rectify_plan plan;
        REQUIRE(rectify_plan_make(&rig, &options, &plan) == ERROR_OK);
        for (rectify_side side : {RECTIFY_LEFT, RECTIFY_RIGHT}) {
            const double most_px = compare_maps(plan, rig, side, 1);
            MESSAGE("scale " << scale << ", " << plan.width_px << "x" << plan.height_px
                             << ": worst difference " << most_px << " px");
            CHECK(most_px < 0.02);
        }
    }
}

TEST_CASE("coordinates on 200 random rigs, f to 27,000 px, vergence to 10 degrees") {
    random_rig::Random random(synthetic::test_seed());
    INFO("seed " << synthetic::test_seed());
    double most_px = 0, longest_px = 0;
    for (int i = 0; i < 200; i++) {
        const calibration rig = random_rig::make(random, 2048, 1536);
        rectify_plan plan;
        REQUIRE(rectify_plan_make(&rig, &as_it_is, &plan) == ERROR_OK);
        longest_px = std::max(longest_px, plan.f_px);
        for (rectify_side side : {RECTIFY_LEFT, RECTIFY_RIGHT}) {
            const double px = compare_maps(plan, rig, side, 37);
            CAPTURE(i);
            CHECK(px < 0.02);
            most_px = std::max(most_px, px);
        }
    }
    MESSAGE("worst difference " << most_px << " px, longest focal length " << longest_px << " px");
    CHECK(longest_px > 20000);
}

// cv::remap rounds coordinates to 1/32 px: the difference is reported, and bounded by what such a
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
        int most = 0;
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
                    most = std::max(most, difference);
                    sum += difference;
                    beyond_one += difference > 1;
                    count++;
                }
            }
        }
        MESSAGE(std::string(is_left ? "left" : "right")
                << ": mean difference " << sum / count << " grey levels, largest " << most << ", "
                << 100 * beyond_one / count << " % of pixels differ by more than one");
        CHECK(sum / count < 0.5);
        CHECK(most <= 1 + 2 * 255 / 64);  // half a 32nd of a pixel in x and in y, full contrast
    }
}

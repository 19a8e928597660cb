// SPDX-License-Identifier: Apache-2.0
// Our matcher compared with OpenCV's on the same pixels, by the same rule (see
// tools/host/evaluate/evaluate.hpp): on synthetic scenes with exact ground truth and on a recorded
// pair.
#include "stereo/match/match.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"
#include "tools/host/evaluate/evaluate.hpp"

using namespace synthetic;

namespace {

constexpr float kRejected = std::numeric_limits<float>::quiet_NaN();

struct Task {
    int width, height, disparities;
    std::vector<uint8_t> left, right;
    std::vector<float> truth_px;
    std::vector<uint8_t> mask;
};

Task task_of(const Pair &pair, int disparities) {
    Task task{pair.width, pair.height, disparities, {}, {}, {}, {}};
    task.left = as_u8(pair.left, pair.width, pair.height, pair.bits, pair.width);
    task.right = as_u8(pair.right, pair.width, pair.height, pair.bits, pair.width);
    for (size_t i = 0; i < task.left.size(); i++) {
        task.truth_px.push_back(static_cast<float>(pair.left_truth.disparity_px[i]));
        task.mask.push_back(pair.left_truth.visibility[i] == Visibility::Visible
                                ? EVALUATE_VISIBLE
                                : EVALUATE_OCCLUDED);
    }
    return task;
}

std::vector<float> ours(const Task &task, match_preset preset = MATCH_PRESET_STANDARD) {
    match_options options = match_default_options(0, task.disparities);
    options.preset = preset;
    const Matched matched = run_match(task.left, task.right, task.width, task.height, options);
    REQUIRE(matched.status == ERROR_OK);
    std::vector<float> result;
    for (size_t i = 0; i < matched.reason.size(); i++) {
        result.push_back(matched.valid(i) ? static_cast<float>(matched.disparity_px(i))
                                          : kRejected);
    }
    return result;
}

// The settings of the benchmark: left border searched by padding, left-right check on.
std::vector<float> sgbm(const Task &task, int mode) {
    const int pad = task.disparities;
    std::vector<uint8_t> pixels[2] = {task.left, task.right};
    cv::Mat padded[2];
    for (int side = 0; side < 2; side++) {
        const cv::Mat image(task.height, task.width, CV_8U, pixels[side].data());
        cv::copyMakeBorder(image, padded[side], 0, 0, pad, 0, cv::BORDER_REPLICATE);
    }
    cv::Mat disparity;
    cv::StereoSGBM::create(0, task.disparities, 3, 72, 288, 1, 63, 0, 0, 0, mode)
        ->compute(padded[0], padded[1], disparity);
    std::vector<float> result;
    for (int y = 0; y < task.height; y++) {
        for (int x = 0; x < task.width; x++) {
            const int16_t value = disparity.at<int16_t>(y, x + pad);
            result.push_back(value < 0 ? kRejected : static_cast<float>(value) / 16);
        }
    }
    return result;
}

evaluate_result assessed(const Task &task, const std::vector<float> &disparity) {
    evaluate_input input;
    input.width_px = task.width;
    input.height_px = task.height;
    input.disparity_px = disparity.data();
    input.truth_px = task.truth_px.data();
    input.mask = task.mask.data();
    return evaluate_disparity(input);
}

double filled_bad_1px(const Task &task, const std::vector<float> &disparity) {
    return assessed(task, disparity).filled_visible.bad_percent[1];
}

// Share of the occluded pixels for which a method reports a disparity.
double hidden_claimed(const Task &task, const std::vector<float> &disparity) {
    int hidden = 0, claimed = 0;
    for (size_t i = 0; i < disparity.size(); i++) {
        hidden += task.mask[i] == EVALUATE_OCCLUDED;
        claimed += task.mask[i] == EVALUATE_OCCLUDED && std::isfinite(disparity[i]);
    }
    return static_cast<double>(claimed) / hidden;
}

}  // namespace

TEST_CASE("on synthetic scenes we are wrong less often than three-way SGBM") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(320, 240, 800, 100);
    double our_mean = 0, their_mean = 0;
    for (const double noise : {0.0, 3.0}) {
        for (const double contrast : {0.05, 0.15}) {
            RenderOptions options;
            options.seed = seed;
            options.left.noise_grey = options.right.noise_grey = noise;
            const Task task =
                task_of(render(everything(rig, 40, {3, contrast}, seed), rig, options), 48);
            const std::vector<float> our = ours(task);
            const std::vector<float> their = sgbm(task, cv::StereoSGBM::MODE_SGBM_3WAY);
            const double our_bad = filled_bad_1px(task, our);
            const double their_bad = filled_bad_1px(task, their);
            MESSAGE("noise ", noise, " contrast ", contrast, ": bad-1.0 ours ", our_bad,
                    " %, three-way ", their_bad, " %; hidden pixels claimed: ours ",
                    hidden_claimed(task, our), ", three-way ", hidden_claimed(task, their));
            our_mean += our_bad / 4;
            their_mean += their_bad / 4;
            CHECK(hidden_claimed(task, our) < hidden_claimed(task, their) + 0.05);
        }
    }
    CHECK(our_mean < their_mean);
}

TEST_CASE("on a recorded pair we are wrong less often than three-way SGBM") {
    // Half the size of aloe, as the full one takes a second per method. Its ground truth is in
    // whole pixels.
    const std::string samples = VERGENCE_OPENCV_SAMPLES;
    const cv::Mat left = cv::imread(samples + "/aloeL.jpg", cv::IMREAD_GRAYSCALE);
    const cv::Mat right = cv::imread(samples + "/aloeR.jpg", cv::IMREAD_GRAYSCALE);
    const cv::Mat truth = cv::imread(samples + "/aloeGT.png", cv::IMREAD_GRAYSCALE);
    REQUIRE_MESSAGE(!left.empty(), "aloe of opencv-doc is missing in ", samples);
    REQUIRE(truth.size() == left.size());
    const cv::Size half(left.cols / 2, left.rows / 2);
    cv::Mat small[2];
    cv::resize(left, small[0], half, 0, 0, cv::INTER_AREA);
    cv::resize(right, small[1], half, 0, 0, cv::INTER_AREA);
    Task task{half.width, half.height, 112, {}, {}, {}, {}};
    for (int y = 0; y < half.height; y++) {
        for (int x = 0; x < half.width; x++) {
            task.left.push_back(small[0].at<uint8_t>(y, x));
            task.right.push_back(small[1].at<uint8_t>(y, x));
            const int disparity = truth.at<uint8_t>(2 * y, 2 * x);
            task.truth_px.push_back(static_cast<float>(disparity) / 2);
            const bool known = disparity > 0;
            const bool inside = x - disparity / 2 >= 0;
            task.mask.push_back(!known ? EVALUATE_UNKNOWN
                                       : (inside ? EVALUATE_VISIBLE : EVALUATE_OCCLUDED));
        }
    }
    const double our_bad = filled_bad_1px(task, ours(task));
    const double their_bad = filled_bad_1px(task, sgbm(task, cv::StereoSGBM::MODE_SGBM_3WAY));
    MESSAGE("bad-1.0: ours ", our_bad, " %, three-way ", their_bad, " %");
    CHECK(our_bad < their_bad);
}

// Bars narrower than the five pixels of our census window are mostly lost by both.
TEST_CASE("bars of a few pixels: as many as three-way SGBM finds") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(320, 160, 800, 100);
    for (const double jump : {4.0, 8.0, 14.0}) {
        Builder builder(rig, seed);
        Scene scene = wall(rig, 12, 0, 0, {2.5, 0.15}, seed);
        const int widths[] = {5, 6, 8, 11};
        for (int i = 0; i < 4; i++) {
            scene.surfaces.push_back(builder.piece(12 + jump, 60 + 60 * i, 10, widths[i], 140,
                                                   builder.noise(12 + jump, 2.5, 0.15)));
        }
        RenderOptions options;
        options.seed = seed;
        options.left.noise_grey = options.right.noise_grey = 1;
        const Pair pair = render(scene, rig, options);
        Task task = task_of(pair, 48);
        for (int i = 0; i < 4; i++) {
            for (size_t p = 0; p < task.mask.size(); p++) {
                task.mask[p] =
                    pair.left_truth.surface[p] == i + 1 ? EVALUATE_VISIBLE : EVALUATE_UNKNOWN;
            }
            const double our_bad = filled_bad_1px(task, ours(task, MATCH_PRESET_BEST));
            const double near_bad = filled_bad_1px(task, ours(task));
            const double their_bad =
                filled_bad_1px(task, sgbm(task, cv::StereoSGBM::MODE_SGBM_3WAY));
            MESSAGE("jump ", jump, " width ", widths[i], ": lost best ", our_bad, " %, standard ",
                    near_bad, " %, three-way ", their_bad, " %");
            CHECK(our_bad < their_bad + 5);
            // A surface found at a quarter of the size does not contain two pixels there.
            CHECK((widths[i] < 8 || near_bad < their_bad + 5));
        }
    }
}

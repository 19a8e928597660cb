// SPDX-License-Identifier: Apache-2.0
// The greedy-path baseline compared bit by bit with a plain transcription of the method in
// match_paper.h, and by accuracy with OpenCV's block matcher and our matcher on a recorded pair.
#include "stereo/match/match_paper.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/error.h"
#include "synthetic/camera.hpp"
#include "synthetic/matched.hpp"
#include "synthetic/seed.hpp"
#include "tools/host/evaluate/evaluate.hpp"

using namespace synthetic;

namespace {

struct View {
    int width, height;
    std::vector<uint8_t> grey;
    std::vector<rectify_span> span;

    bool inside(int x, int y) const {
        const rectify_span row = span[static_cast<size_t>(y)];
        return x >= row.begin && x < row.end;
    }
    int at(int x, int y) const {
        y = std::clamp(y, 0, height - 1);
        return inside(x, y) ? grey[static_cast<size_t>(y * width + x)] : 0;
    }
};

struct Expected {
    int disparity_q8, reason, confidence;
};

struct Place {
    int disparity = 0;
    int score = 0;
};
using Path = std::vector<std::optional<Place>>;

// One row, step by step, without precomputation.
class Reference {
  public:
    Reference(const View &left, const View &right, const match_options &options, int y)
        : left_(left), right_(right), options_(options), y_(y) {}

    std::vector<Expected> row() const {
        const Path first = walk(1, Path(size()));
        const Path back = walk(-1, first);
        const Path forward = walk(1, back);
        std::vector<std::optional<int>> kept(size()), guess(size());
        for (size_t x = 0; x < size(); x++) {
            const auto &a = forward[x], &b = back[x];
            const bool back_wins = b && (!a || b->score < a->score);
            guess[x] = a || b ? std::optional<int>((back_wins ? b : a)->disparity) : std::nullopt;
            if (a && b && std::abs(a->disparity - b->disparity) <= 1) {
                kept[x] = guess[x];
            }
        }
        repair(kept, guess);
        std::vector<Expected> row;
        for (int x = 0; x < left_.width; x++) {
            row.push_back(assessed(x, kept, guess));
        }
        return row;
    }

  private:
    size_t size() const { return static_cast<size_t>(left_.width); }

    bool inside(int l, int r) const { return left_.inside(l, y_) && right_.inside(r, y_); }

    std::array<bool, 30> signature(const View &view, int x) const {
        std::array<bool, 30> bits{};
        for (int j = 0; j < 5; j++) {
            const int y = std::clamp(y_ + j - 2, 0, view.height - 1);
            const int centre = view.at(x, y);
            const int around[6] = {view.at(x - 2, y), view.at(x - 1, y), view.at(x + 1, y),
                                   view.at(x + 2, y), view.at(x, y - 2), view.at(x, y + 2)};
            for (int i = 0; i < 6; i++) {
                bits[static_cast<size_t>(6 * j + i)] = around[i] > centre;
            }
        }
        return bits;
    }

    int dissimilarity(int l, int r) const {
        const auto a = signature(left_, l), b = signature(right_, r);
        return static_cast<int>(std::inner_product(a.begin(), a.end(), b.begin(), size_t{0},
                                                   std::plus<>(), std::not_equal_to<>()));
    }

    int or_chance(int x, int disparity) const {
        const bool searched = disparity >= options_.disparity_min &&
                              disparity < options_.disparity_min + options_.disparity_count;
        return searched && inside(x, x - disparity) ? dissimilarity(x, x - disparity) : 15;
    }

    std::optional<int> score(int l, int r, int direction) const {
        int sum = 0;
        for (int i = 0; i < 8; i++) {
            if (!inside(l + i * direction, r + i * direction)) {
                return std::nullopt;
            }
            sum += dissimilarity(l + i * direction, r + i * direction);
        }
        return sum;
    }

    Path walk(int direction, const Path &other) const {
        const rectify_span left = left_.span[static_cast<size_t>(y_)];
        const rectify_span right = right_.span[static_cast<size_t>(y_)];
        const int last = options_.disparity_min + options_.disparity_count - 1;
        int l = direction > 0 ? left.begin : left.end - 1;
        int r = direction > 0 ? right.begin : right.end - 1;
        const int start = l - r;
        skip(std::clamp(start, options_.disparity_min, last) - start, direction, &l, &r);
        Path path(size());
        int straight = score(l, r, direction).value_or(0);
        for (; inside(l, r); l += direction, r += direction) {
            straight = score(l, r, direction).value_or(straight);
            int change = 0, lowest = straight, best = straight;
            const auto consider = [&](int candidate, int penalty) {
                int to_l = l, to_r = r;
                skip(candidate, direction, &to_l, &to_r);
                const int disparity = to_l - to_r;
                const int limit = lowest - penalty - 1;
                const auto there = score(to_l, to_r, direction);
                if (disparity < options_.disparity_min || disparity > last || !there ||
                    *there > limit) {
                    return;
                }
                const int quarter =
                    dissimilarity(to_l, to_r) + dissimilarity(to_l + direction, to_r + direction);
                if (2 * quarter <= limit) {
                    change = candidate;
                    best = *there;
                    lowest = best + penalty;
                }
            };
            const auto &across = other[static_cast<size_t>(l)];
            if (across && across->disparity != l - r) {
                consider(across->disparity - (l - r), 8);
            }
            for (int jump = 1; jump <= 32; jump++) {
                if (straight > (jump == 1 ? 48 : 80)) {
                    consider(jump, jump == 1 ? 8 : 32);
                    consider(-jump, jump == 1 ? 8 : 32);
                }
            }
            if (change == direction) {
                path[static_cast<size_t>(l)] = Place{l - r, straight};
            }
            skip(change, direction, &l, &r);
            path[static_cast<size_t>(l)] = Place{l - r, best};
            straight = best;
        }
        return path;
    }

    static void skip(int change, int direction, int *l, int *r) {
        *(change * direction > 0 ? l : r) += direction * std::abs(change);
    }

    void repair(std::vector<std::optional<int>> &kept,
                std::vector<std::optional<int>> &guess) const {
        const auto span = left_.span[static_cast<size_t>(y_)];
        const auto is_kept = [&](int x) { return kept[static_cast<size_t>(x)].has_value(); };
        for (int begin = span.begin + 1; begin < span.end; begin++) {
            int end = begin;
            while (end < span.end && !is_kept(end)) {
                end++;
            }
            if (end == begin || end == span.end || !is_kept(begin - 1)) {
                continue;
            }
            const int left = *kept[static_cast<size_t>(begin - 1)];
            const int right = *kept[static_cast<size_t>(end)];
            const int hidden = std::min(right - left > 1 ? right - left : 0, end - begin);
            int edge = begin, lowest = std::numeric_limits<int>::max();
            for (int e = begin; e + hidden <= end; e++) {
                int cost = 0;
                for (int x = begin; x < end; x++) {
                    cost += x < e ? or_chance(x, left) : x < e + hidden ? 0 : or_chance(x, right);
                }
                edge = cost < lowest ? e : edge;
                lowest = std::min(lowest, cost);
            }
            for (int x = begin; x < end; x++) {
                const int disparity = x < edge + hidden ? left : right;
                guess[static_cast<size_t>(x)] = disparity;
                if (x < edge || x >= edge + hidden) {
                    kept[static_cast<size_t>(x)] = disparity;
                }
            }
            begin = end;
        }
    }

    Expected assessed(int x, const std::vector<std::optional<int>> &kept,
                      const std::vector<std::optional<int>> &guess) const {
        const rectify_span right = right_.span[static_cast<size_t>(y_)];
        const int first = options_.disparity_min, last = first + options_.disparity_count - 1;
        const int min = std::max(first, x - right.end + 1);
        const int max = std::min(last, x - right.begin);
        if (!left_.inside(x, y_) || min > max) {
            return {256 * first, REASON_BORDER, 0};
        }
        const auto own = kept[static_cast<size_t>(x)];
        if (!own) {
            const int far = guess[static_cast<size_t>(x)].value_or(min);
            return {256 * std::clamp(far, min, max), untextured_or(REASON_OCCLUDED, x), 0};
        }
        int sum[5] = {0, 0, 0, 0, 0}, count = 0;
        for (int i = std::max(0, x - 4); i < std::min(left_.width, x + 5); i++) {
            if (const auto near = kept[static_cast<size_t>(i)]) {
                count++;
                for (int j = 0; j < 5; j++) {
                    sum[j] += or_chance(i, *near + j - 2);
                }
            }
        }
        const int risen = std::min(sum[0], sum[4]);
        const int before = sum[1] - sum[2], after = sum[3] - sum[2];
        int offset = 0;
        if (*own > min && *own < max) {
            offset = std::clamp(128 * (before - after) / std::max({before, after, 1}), -128, 128);
        }
        const int confidence = risen > sum[2] ? 255 * (risen - sum[2]) / (risen + sum[2]) : 0;
        int reason = REASON_VALID;
        if (sum[2] > 10 * count ||
            (options_.disparity_count > 2 && (*own == first || *own == last))) {
            reason = untextured_or(REASON_OUT_OF_RANGE, x);
        } else if (risen - sum[2] < count) {
            reason = untextured_or(REASON_AMBIGUOUS, x);
        }
        return {256 * *own + offset, reason, confidence};
    }

    int untextured_or(int reason, int x) const {
        int darkest = 255, brightest = 0;
        for (int i = x - 8; i <= x + 8; i++) {
            if (left_.inside(i, y_)) {
                darkest = std::min(darkest, left_.at(i, y_));
                brightest = std::max(brightest, left_.at(i, y_));
            }
        }
        return brightest - darkest >= 6 ? reason : static_cast<int>(REASON_NO_TEXTURE);
    }

    const View &left_, &right_;
    match_options options_;
    int y_;
};

struct Output {
    std::vector<int32_t> disparity_q8;
    std::vector<uint8_t> reason, confidence;
};

Output run_paper(View left, View right, const match_options &options) {
    const size_t pixels = left.grey.size();
    Output output{std::vector<int32_t>(pixels), std::vector<uint8_t>(pixels),
                  std::vector<uint8_t>(pixels)};
    const int width = left.width, height = left.height;
    const match_input input = {{left.grey.data(), width, height, width},
                               {right.grey.data(), width, height, width},
                               left.span.data(),
                               right.span.data(),
                               false};
    match_output views = {{output.disparity_q8.data(), width, height, width},
                          {output.reason.data(), width, height, width},
                          {output.confidence.data(), width, height, width}};
    const Memory memory(match_paper_need_bytes(width, &options));
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    REQUIRE(match_paper_run(&input, &options, nullptr, nullptr, &arena, &views) == ERROR_OK);
    return output;
}

std::vector<rectify_span> whole(int width, int height) {
    return std::vector<rectify_span>(static_cast<size_t>(height),
                                     rectify_span{0, static_cast<int16_t>(width)});
}

}  // namespace

TEST_CASE("bit by bit what the plain transcription gives") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    const auto integer = [&](int min, int max) {
        return min + static_cast<int>(random.bits() % static_cast<uint64_t>(max - min + 1));
    };
    int valid = 0, repaired_or_rejected = 0;
    for (int round = 0; round < 80; round++) {
        const int width = integer(MATCH_MIN_WIDTH_PX, 90), height = integer(8, 14);
        View left{width, height, {}, whole(width, height)};
        View right = left;
        // Smooth noise; two surfaces, the nearer one a block, with noise of one grey level.
        cv::Mat texture(height, width + 80, CV_8U);
        for (int i = 0; i < texture.rows * texture.cols; i++) {
            texture.data[i] = static_cast<uint8_t>(random.bits());
        }
        cv::GaussianBlur(texture, texture, {}, 0.5 + 0.1 * (round % 8));
        const int far = integer(-5, 10), near = far + integer(0, 30);
        const int begin = integer(0, width - 1), end = integer(begin, width);
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                const bool before = x >= begin && x < end;
                left.grey.push_back(static_cast<uint8_t>(texture.at<uint8_t>(y, x + 30) / 2 +
                                                         integer(0, 2) + (before ? 20 : 0)));
                const bool seen = x + near >= begin && x + near < end;
                const int from = x + (seen ? near : far);
                right.grey.push_back(static_cast<uint8_t>(texture.at<uint8_t>(y, from + 30) / 2 +
                                                          integer(0, 2) + (seen ? 20 : 0)));
            }
            if (round % 3 == 0) {
                left.span[static_cast<size_t>(y)] = {static_cast<int16_t>(integer(0, 9)),
                                                     static_cast<int16_t>(integer(10, width))};
                right.span[static_cast<size_t>(y)] = {static_cast<int16_t>(integer(0, 9)),
                                                      static_cast<int16_t>(integer(10, width))};
            }
        }
        match_options options =
            match_default_options(far - integer(0, 10), integer(1, round % 4 == 0 ? 3 : 70));
        options.speckle_px = 0;
        const Output output = run_paper(left, right, options);
        int differing = 0;
        for (int y = 0; y < height; y++) {
            const std::vector<Expected> row = Reference(left, right, options, y).row();
            for (int x = 0; x < width; x++) {
                const auto i = static_cast<size_t>(y * width + x);
                const Expected &pixel = row[static_cast<size_t>(x)];
                differing += output.disparity_q8[i] != pixel.disparity_q8 ||
                             output.reason[i] != pixel.reason ||
                             output.confidence[i] != pixel.confidence;
                valid += pixel.reason == REASON_VALID;
                repaired_or_rejected += pixel.reason != REASON_VALID;
            }
        }
        CAPTURE(round);
        CHECK(differing == 0);
    }
    CHECK(valid > 5000);
    CHECK(repaired_or_rejected > 5000);
}

TEST_CASE("on a recorded pair: better than OpenCV's block matcher, worse than our matcher") {
    // A third of the size of aloe. Its ground truth is in whole pixels of the full size.
    const std::string samples = VERGENCE_OPENCV_SAMPLES;
    cv::Mat images[2] = {cv::imread(samples + "/aloeL.jpg", cv::IMREAD_GRAYSCALE),
                         cv::imread(samples + "/aloeR.jpg", cv::IMREAD_GRAYSCALE)};
    const cv::Mat truth = cv::imread(samples + "/aloeGT.png", cv::IMREAD_GRAYSCALE);
    REQUIRE_MESSAGE(!images[0].empty(), "aloe of opencv-doc is missing in ", samples);
    const int width = truth.cols / 3, height = truth.rows / 3, disparities = 80;
    View left{width, height, {}, whole(width, height)};
    View right = left;
    for (cv::Mat &image : images) {
        cv::resize(image, image, {width, height}, 0, 0, cv::INTER_AREA);
        (&image == images ? left : right).grey.assign(image.begin<uint8_t>(), image.end<uint8_t>());
    }
    std::vector<float> truth_px;
    std::vector<uint8_t> mask;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const auto disparity = static_cast<float>(truth.at<uint8_t>(3 * y + 1, 3 * x + 1)) / 3;
            truth_px.push_back(disparity);
            const bool seen = static_cast<float>(x) >= disparity;
            mask.push_back(disparity > 0 ? (seen ? EVALUATE_VISIBLE : EVALUATE_OCCLUDED)
                                         : EVALUATE_UNKNOWN);
        }
    }
    const auto bad_percent = [&](const std::string &name, const std::vector<float> &disparity) {
        evaluate_input input;
        input.width_px = width;
        input.height_px = height;
        input.disparity_px = disparity.data();
        input.truth_px = truth_px.data();
        input.mask = mask.data();
        const evaluate_result result = evaluate_disparity(input);
        MESSAGE(name, ": bad-1.0 ", result.filled_visible.bad_percent[1], " %, density ",
                result.density_visible_percent, " %");
        return result.filled_visible.bad_percent[1];
    };
    const auto disparity_px = [](const std::vector<int32_t> &disparity_q8,
                                 const std::vector<uint8_t> &reason) {
        std::vector<float> disparity;
        for (size_t i = 0; i < reason.size(); i++) {
            disparity.push_back(reason[i] == REASON_VALID
                                    ? static_cast<float>(disparity_q8[i]) / 256
                                    : std::numeric_limits<float>::quiet_NaN());
        }
        return disparity;
    };
    const match_options options = match_default_options(0, disparities);
    const Output paper = run_paper(left, right, options);
    const Matched ours = run_match(left.grey, right.grey, width, height, options);
    // Padded, so that the block matcher covers the left border.
    for (cv::Mat &image : images) {
        cv::copyMakeBorder(image, image, 0, 0, disparities, 0, cv::BORDER_REPLICATE);
    }
    cv::Mat block;
    cv::StereoBM::create(disparities, 11)->compute(images[0], images[1], block);
    std::vector<float> block_px;
    for (int i = 0; i < width * height; i++) {
        const int16_t value = block.at<int16_t>(i / width, i % width + disparities);
        block_px.push_back(value < 0 ? std::numeric_limits<float>::quiet_NaN()
                                     : static_cast<float>(value) / 16);
    }
    const double paper_bad = bad_percent("paper", disparity_px(paper.disparity_q8, paper.reason));
    CHECK(paper_bad < bad_percent("StereoBM", block_px));
    CHECK(paper_bad > bad_percent("ours", disparity_px(ours.disparity_q8, ours.reason)));
}

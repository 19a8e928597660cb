// SPDX-License-Identifier: Apache-2.0
// The truth of synthetic pairs, which other tests trust.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "synthetic/pair.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"

using namespace synthetic;

namespace {

constexpr double kPi = 3.14159265358979323846;

// Row value between pixels by a Lanczos filter of 12 taps: better than 0.1 % for noise cells of
// 3 px and more, and no code of ours.
double interpolate(const uint16_t *row, int width, double x) {
    const int first = static_cast<int>(std::floor(x)) - 5;
    double sum = 0;
    double weights = 0;
    for (int i = first; i < first + 12; i++) {
        const double away = x - i;
        const double weight = away == 0 ? 1
                                        : std::sin(kPi * away) * std::sin(kPi * away / 6) * 6 /
                                              (kPi * kPi * away * away);
        sum += weight * row[std::clamp(i, 0, width - 1)];
        weights += weight;
    }
    return sum / weights;
}

struct Warp {
    int pixels;
    double rms;      // RMS of left - warped right, share of the left image's own scatter
    double bias_px;  // disparity error that best explains the difference
};

Warp warp_right_to_left(const Pair &pair, double disparity_error_px) {
    const std::vector<bool> inner = inner_pixels(pair, pair.left_truth, 1);
    const std::vector<bool> inner_right = inner_pixels(pair, pair.right_truth, 7);
    Warp result{0, 0, 0};
    double squares = 0, own = 0, own_sum = 0, slope_error = 0, slope_slope = 0;
    for (int y = 0; y < pair.height; y++) {
        const uint16_t *right = &pair.right[pair.index(0, y)];
        for (int x = 0; x < pair.width; x++) {
            const size_t i = pair.index(x, y);
            const double there = x - pair.left_truth.disparity_px[i] + disparity_error_px;
            if (!inner[i] || pair.left_truth.visibility[i] != Visibility::Visible || there < 6 ||
                there > pair.width - 7 ||
                !inner_right[pair.index(static_cast<int>(std::lround(there)), y)]) {
                continue;
            }
            const double error = pair.left[i] - interpolate(right, pair.width, there);
            const double slope = interpolate(right, pair.width, there + 0.5) -
                                 interpolate(right, pair.width, there - 0.5);
            squares += error * error;
            own_sum += pair.left[i];
            own += static_cast<double>(pair.left[i]) * pair.left[i];
            slope_error += slope * error;
            slope_slope += slope * slope;
            result.pixels++;
        }
    }
    const double mean = own_sum / result.pixels;
    result.rms = std::sqrt(squares / (own - mean * own_sum));
    result.bias_px = slope_error / slope_slope;
    return result;
}

Pair rendered(const Scene &scene, const Rig &rig, int bits, int samples, uint64_t seed) {
    RenderOptions options;
    options.left.bits = options.right.bits = bits;
    options.samples = samples;
    options.seed = seed;
    return render(scene, rig, options);
}

}  // namespace

TEST_CASE("the truth warps the right image onto the left one") {
    const uint64_t seed = test_seed();
    for (const double at_infinity : {0.0, -50.0}) {
        const Rig rig = rectified_rig(240, 160, 800, 100, at_infinity);
        const Scene scene = everything(rig, 40 + at_infinity, {3.5, 0.12}, seed);
        const Pair pair = rendered(scene, rig, 16, 1, seed);
        const Warp exact = warp_right_to_left(pair, 0);
        CAPTURE(at_infinity);
        CAPTURE(exact.rms);
        CAPTURE(exact.bias_px);
        CHECK(exact.pixels > 10000);
        CHECK(exact.rms < 0.01);
        CHECK(std::abs(exact.bias_px) < 0.001);
        // The check can fail: 0.05 px beside the truth is seen, and its size is read back.
        const Warp beside = warp_right_to_left(pair, 0.05);
        CHECK(beside.rms > 2 * exact.rms);
        CHECK(beside.bias_px == doctest::Approx(-0.05).epsilon(0.05));
    }
}

// SPDX-License-Identifier: Apache-2.0
// Time of the focus measures for a window of a mosaic, beside the same measures by OpenCV, which
// must give the same energies; and that of all that autofocus takes from a frame.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "focus/focus_curve.h"
#include "focus/focus_measure.h"

namespace {

constexpr int kSidePx = 100, kRounds = 200, kRepeats = 20;
constexpr uint16_t kFull = 1023;
constexpr focus_noise kNoNoise = {0, 0, 0};

// A blurred texture with noise; even rows G R, odd rows B G.
cv::Mat mosaic() {
    std::mt19937 random(1);
    cv::Mat texture(kSidePx, kSidePx, CV_32F), raw(kSidePx, kSidePx, CV_16U);
    for (auto &value : cv::Mat_<float>(texture)) {
        value = float(random() % 1000);
    }
    cv::GaussianBlur(texture, texture, cv::Size(0, 0), 1.5);
    for (int y = 0; y < kSidePx; y++) {
        for (int x = 0; x < kSidePx; x++) {
            const float colour = (x + y) % 2 == 0 ? 1 : 0.6F;
            raw.at<uint16_t>(y, x) = uint16_t(100 + colour * texture.at<float>(y, x));
        }
    }
    return raw;
}

// One of the two green planes.
cv::Mat green_of(const cv::Mat &raw, int odd) {
    cv::Mat green(raw.rows / 2, raw.cols / 2, CV_16U);
    for (int y = 0; y < green.rows; y++) {
        const uint16_t *from = raw.ptr<uint16_t>(2 * y + odd) + odd;
        for (int x = 0; x < green.cols; x++) {
            green.at<uint16_t>(y, x) = from[2 * x];
        }
    }
    return green;
}

double mean_square(const cv::Mat &filtered) {
    const cv::Mat inner =
        filtered(cv::Rect(1, 1, filtered.cols - 2, filtered.rows - 2));  // no border
    return inner.dot(inner) / double(inner.total());
}

double opencvs(const cv::Mat &raw, focus_measure measure) {
    double energy = 0;
    for (int odd = 0; odd < 2; odd++) {
        const cv::Mat green = green_of(raw, odd);
        cv::Mat x, y;
        if (measure == FOCUS_TENENGRAD) {
            cv::Sobel(green, x, CV_32F, 1, 0);
            cv::Sobel(green, y, CV_32F, 0, 1);
            energy += mean_square(x) + mean_square(y);
        } else if (measure == FOCUS_LAPLACIAN) {
            cv::Laplacian(green, x, CV_32F);
            energy += mean_square(x);
        } else {
            cv::Scalar mean, deviation;
            cv::meanStdDev(green, mean, deviation);
            energy +=
                deviation[0] * deviation[0] / (measure == FOCUS_VARIANCE ? 1 : mean[0] * mean[0]);
        }
    }
    return energy / 2;
}

template <typename Work>
double timed_ms(Work work) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kRepeats; i++) {
        work();
    }
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - begin;
    return taken.count() / kRepeats;
}

double unit_of(focus_measure measure) {
    return measure == FOCUS_NORMALIZED_VARIANCE ? 1.0 / (1 << FOCUS_NORMALIZED_SHIFT) : 1.0 / 256;
}

}  // namespace

int main() {
    cv::setNumThreads(1);
    const cv::Mat raw = mosaic();
    const focus_window window = {raw.ptr<uint16_t>(), std::size_t(raw.step1()), kSidePx, kSidePx,
                                 kFull};
    const std::array<const char *, FOCUS_MEASURES> names = {"variance", "variance / mean^2",
                                                            "Tenengrad", "Laplacian"};
    volatile double sink = 0;
    bool same = true;
    std::printf(
        "focus measures, green of %d x %d px, 10 bit, 1 thread (best of %d interleaved "
        "rounds)\n",
        kSidePx, kSidePx, kRounds);
    std::printf("  %-22s %10s %10s %10s\n", "", "ms", "OpenCV ms", "energy");
    for (int i = 0; i < FOCUS_MEASURES; i++) {
        const auto measure = focus_measure(i);
        double our_ms = std::numeric_limits<double>::infinity(), their_ms = our_ms;
        for (int round = 0; round < kRounds; round++) {
            our_ms = std::min(
                our_ms, timed_ms([&] {
                    sink = double(
                        focus_measure_window(&window, FOCUS_GREEN, measure, &kNoNoise).energy);
                }));
            their_ms = std::min(their_ms, timed_ms([&] { sink = opencvs(raw, measure); }));
        }
        const double ours =
            double(focus_measure_window(&window, FOCUS_GREEN, measure, &kNoNoise).energy) *
            unit_of(measure);
        // The mean that ours divides by is that of both planes.
        same = same && std::abs(ours / opencvs(raw, measure) - 1) < 1e-3;
        std::printf("  %-22s %10.4f %10.4f %10.4g\n", names[std::size_t(i)], our_ms, their_ms,
                    ours);
    }
    double all_ms = std::numeric_limits<double>::infinity();
    for (int round = 0; round < kRounds; round++) {
        all_ms = std::min(all_ms, timed_ms([&] {
                              const focus_sample sample =
                                  focus_sample_of(&window, FOCUS_GREEN, FOCUS_VARIANCE, &kNoNoise);
                              sink = double(sample.sharpness[0]);
                          }));
    }
    std::printf("  %-22s %10.4f\n", "a frame of autofocus", all_ms);
    if (!same) {
        std::fprintf(stderr, "sharpness_bench: OpenCV's energies differ\n");
    }
    return same ? 0 : 1;
}

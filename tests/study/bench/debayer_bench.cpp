// SPDX-License-Identifier: Apache-2.0
// Cost of our debayer and of OpenCV's edge-aware one on the sensor's full size, and the error of
// both on a recorded colour image that is reduced to a mosaic.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "stereo/image/debayer.h"

namespace {

constexpr int kRounds = 9;
constexpr int kBits = 10;
constexpr double kGreyToRaw = 1023.0 / 255;

// GRBG as the sensor delivers it: even rows G R, odd rows B G.
cv::Mat mosaic_of(const cv::Mat &bgr) {
    cv::Mat raw(bgr.size(), CV_16U);
    for (int y = 0; y < bgr.rows; y++) {
        for (int x = 0; x < bgr.cols; x++) {
            const int channel = (y + x) % 2 == 0 ? 1 : (y % 2 == 0 ? 2 : 0);
            raw.at<uint16_t>(y, x) =
                static_cast<uint16_t>(std::lround(bgr.at<cv::Vec3b>(y, x)[channel] * kGreyToRaw));
        }
    }
    return raw;
}

cv::Mat ours(const cv::Mat &raw) {
    cv::Mat rgb(raw.size(), CV_16UC3);
    cv::Mat held = raw;
    const image_u16 view = {held.ptr<uint16_t>(), raw.cols, raw.rows, raw.cols};
    std::vector<int32_t> work(3 * (static_cast<std::size_t>(raw.cols) + 4));
    for (int y = 0; y < raw.rows; y++) {
        debayer_row(&view, kBits, y, rgb.ptr<uint16_t>(y), work.data());
    }
    return rgb;
}

// OpenCV names the pattern by the second row's second and third pixel: GRBG is its GB.
cv::Mat opencvs(const cv::Mat &raw) {
    cv::Mat rgb;
    cv::demosaicing(raw, rgb, cv::COLOR_BayerGB2RGB_EA);
    return rgb;
}

double peak_signal_to_noise_db(const cv::Mat &rgb, const cv::Mat &bgr) {
    double squares = 0;
    double count = 0;
    for (int y = 4; y < rgb.rows - 4; y++) {
        for (int x = 4; x < rgb.cols - 4; x++) {
            for (int channel = 0; channel < 3; channel++) {
                const double error = rgb.at<cv::Vec3w>(y, x)[channel] / kGreyToRaw -
                                     bgr.at<cv::Vec3b>(y, x)[2 - channel];
                squares += error * error;
                count++;
            }
        }
    }
    return 10 * std::log10(255 * 255 * count / squares);
}

double timed_ms(const std::function<void()> &work) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - begin;
    return taken.count();
}

int run(const char *path) {
    const cv::Mat bgr = cv::imread(path, cv::IMREAD_COLOR);
    if (bgr.cols < 16 || bgr.rows < 16) {
        std::fprintf(stderr, "debayer_bench: %s: not an image of at least 16x16\n", path);
        return 1;
    }
    cv::setNumThreads(1);
    const cv::Mat raw = mosaic_of(bgr);
    cv::Mat sensor;
    cv::resize(bgr, sensor, cv::Size(2048, 1536), 0, 0, cv::INTER_CUBIC);
    const cv::Mat large = mosaic_of(sensor);
    double our_ms = std::numeric_limits<double>::infinity();
    double their_ms = our_ms;
    for (int round = 0; round < kRounds; round++) {
        our_ms = std::min(our_ms, timed_ms([&] { ours(large); }));
        their_ms = std::min(their_ms, timed_ms([&] { opencvs(large); }));
    }
    const double pixels = static_cast<double>(large.total());
    std::printf("debayer, 2048x1536, 10 bit, 1 thread (best of %d interleaved rounds)\n", kRounds);
    std::printf("  %-22s %8s %10s %14s\n", "", "ms", "ns/pixel", "PSNR dB");
    std::printf("  %-22s %8.1f %10.1f %14.2f\n", "vergence", our_ms, 1e6 * our_ms / pixels,
                peak_signal_to_noise_db(ours(raw), bgr));
    std::printf("  %-22s %8.1f %10.1f %14.2f\n", "OpenCV edge-aware", their_ms,
                1e6 * their_ms / pixels, peak_signal_to_noise_db(opencvs(raw), bgr));
    std::printf("  (PSNR: %s reduced to a mosaic and restored)\n", path);
    return 0;
}

}  // namespace

int main(int argc, char **argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: debayer_bench COLOUR_IMAGE\n");
        return 2;
    }
    try {
        return run(argv[1]);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "debayer_bench: %s\n", error.what());
        return 1;
    }
}

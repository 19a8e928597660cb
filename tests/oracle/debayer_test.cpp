// SPDX-License-Identifier: Apache-2.0
// Demosaicing of photographs whose mosaic the test makes, compared with OpenCV's methods.
#include "stereo/image/debayer.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace {

cv::Mat mosaic_of(const cv::Mat &rgb) {
    cv::Mat mosaic(rgb.size(), CV_8U);
    for (int y = 0; y < rgb.rows; y++) {
        for (int x = 0; x < rgb.cols; x++) {
            const int channel = (x + y) % 2 == 0 ? 1 : y % 2 == 0 ? 0 : 2;
            mosaic.at<uint8_t>(y, x) = rgb.at<cv::Vec3b>(y, x)[channel];
        }
    }
    return mosaic;
}

cv::Mat ours(const cv::Mat &mosaic16) {
    const image_u16 view = {reinterpret_cast<uint16_t *>(mosaic16.data), mosaic16.cols,
                            mosaic16.rows, static_cast<ptrdiff_t>(mosaic16.step1())};
    cv::Mat result(mosaic16.size(), CV_16UC3);
    std::vector<int32_t> work(3 * static_cast<size_t>(mosaic16.cols + DEBAYER_MARGIN_PX));
    for (int y = 0; y < mosaic16.rows; y++) {
        debayer_row(&view, 8, y, result.ptr<uint16_t>(y), work.data());
    }
    return result;
}

// Without a border of 8 px, where OpenCV repeats pixels.
double psnr_db(const cv::Mat &a, const cv::Mat &b) {
    const cv::Rect inner(8, 8, a.cols - 16, a.rows - 16);
    cv::Mat da, db;
    a(inner).convertTo(da, CV_64F);
    b(inner).convertTo(db, CV_64F);
    const double squares = cv::norm(da, db, cv::NORM_L2SQR) / static_cast<double>(3 * inner.area());
    return 10 * std::log10(255.0 * 255.0 / squares);
}

template <typename Work>
double best_ns(int rounds, double pixels, Work work) {
    double best = 1e30;
    for (int i = 0; i < rounds; i++) {
        const auto begin = std::chrono::steady_clock::now();
        work();
        const std::chrono::duration<double, std::nano> took =
            std::chrono::steady_clock::now() - begin;
        best = std::min(best, took.count() / pixels);
    }
    return best;
}

}  // namespace

TEST_CASE("photographs come back better than by OpenCV's bilinear and edge-aware methods") {
    cv::setNumThreads(1);
    for (const std::string name :
         {"aloeL.jpg", "building.jpg", "fruits.jpg", "graf1.png", "home.jpg"}) {
        const std::string path = std::string(VERGENCE_OPENCV_SAMPLES) + "/" + name;
        cv::Mat rgb = cv::imread(path, cv::IMREAD_COLOR);
        INFO(path);
        REQUIRE(!rgb.empty());
        cv::cvtColor(rgb, rgb, cv::COLOR_BGR2RGB);
        rgb = rgb(cv::Rect(0, 0, rgb.cols & ~1, rgb.rows & ~1)).clone();
        const cv::Mat mosaic = mosaic_of(rgb);
        cv::Mat mosaic16, bilinear, edge_aware, developed;
        mosaic.convertTo(mosaic16, CV_16U);
        // OpenCV names a pattern by the second and third pixel of its second row: GRBG is GB.
        cv::cvtColor(mosaic, bilinear, cv::COLOR_BayerGB2RGB);
        const double pixels = static_cast<double>(rgb.total());
        const double their_ns =
            best_ns(3, pixels, [&] { cv::cvtColor(mosaic, edge_aware, cv::COLOR_BayerGB2RGB_EA); });
        const double our_ns = best_ns(3, pixels, [&] { developed = ours(mosaic16); });
        const double our_db = psnr_db(developed, rgb);
        MESSAGE(name << ": ours " << our_db << " dB, bilinear " << psnr_db(bilinear, rgb)
                     << " dB, OpenCV's edge-aware " << psnr_db(edge_aware, rgb) << " dB; " << our_ns
                     << " ns a pixel against " << their_ns << ": ratio " << our_ns / their_ns);
        CHECK(our_db > psnr_db(bilinear, rgb) + 1);
        CHECK(our_db > psnr_db(edge_aware, rgb) + 1);
    }
}

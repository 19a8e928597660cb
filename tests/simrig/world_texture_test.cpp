// SPDX-License-Identifier: Apache-2.0
// The renderer leaves no artefacts in the images: other rays give the same image up to noise, the
// spectrum has no lines, and no area is without texture or noise.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "tests/simrig/world_harness.hpp"
#include "tools/simrig/scene/board.hpp"
#include "tools/simrig/world/random.hpp"

using namespace world_harness;

namespace {

world::FrameRequest request_at(const world::Rig &rig, double zoom) {
    world::Mechanics m = straight(rig, zoom, 1800, 700);
    m.pan_rad = rig.camera[0].pan_rad;
    world::FrameRequest request = steady(m);
    const double n = world::camera_at(rig.camera[0], m).optics.f_number;
    request.exposure_us = 20000 * n * n / 12;
    request.threads = 2;
    return request;
}

cv::Mat green_plane(const world::Frame &frame) {
    cv::Mat plane(frame.rows / 2, frame.columns / 2, CV_32F);
    for (int y = 0; y < plane.rows; y++) {
        for (int x = 0; x < plane.cols; x++) {
            plane.at<float>(y, x) =
                frame.pixels[static_cast<std::size_t>(2 * y * frame.columns + 2 * x)];
        }
    }
    return plane;
}

// The strongest line of the spectrum over the median of its neighbourhood; the maximum over all.
double strongest_line(const cv::Mat &plane) {
    cv::Mat soft;
    cv::GaussianBlur(plane, soft, {}, 12);
    cv::Mat window;
    cv::createHanningWindow(window, plane.size(), CV_32F);
    cv::Mat flat = (plane - soft).mul(window);
    cv::Mat spectrum;
    cv::dft(flat, spectrum, cv::DFT_COMPLEX_OUTPUT);
    cv::Mat power(plane.size(), CV_32F);
    for (int y = 0; y < plane.rows; y++) {
        for (int x = 0; x < plane.cols; x++) {
            const auto v = spectrum.at<cv::Vec2f>(y, x);
            power.at<float>(y, x) = v[0] * v[0] + v[1] * v[1];
        }
    }
    double strongest = 0;
    std::vector<float> around;
    for (int y = 8; y < plane.rows / 2; y += 1) {
        for (int x = 8; x + 8 < plane.cols; x += 1) {
            const float here = power.at<float>(y, x);
            if (here < 3e-7F * static_cast<float>(plane.total()) * 1000) {
                continue;
            }
            around.clear();
            for (int dy = -7; dy <= 7; dy++) {
                for (int dx = -7; dx <= 7; dx++) {
                    if (std::abs(dx) > 2 || std::abs(dy) > 2) {
                        around.push_back(power.at<float>(y + dy, x + dx));
                    }
                }
            }
            std::nth_element(around.begin(), around.begin() + static_cast<long>(around.size() / 2),
                             around.end());
            const double median = static_cast<double>(around[around.size() / 2]);
            strongest = std::max(strongest, static_cast<double>(here) / median);
        }
    }
    return strongest;
}

// The lens's faults, but no noise of the sensor: what differs between two frames is the sampling.
world::Rig rig_without_noise() {
    world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    rig.mains.modulation = 0;
    world::Sensor &sensor = rig.camera[0].sensor;
    sensor.read_noise_e = sensor.photon_noise = sensor.prnu = sensor.row_noise_e = 0;
    return rig;
}

// Variance of a pixel's own noise, DN^2.
double noise2_of(double dn) {
    const double electrons = std::max(dn - 42, 0.0) * 8500 / 981;
    return (electrons + 64) * (981.0 / 8500) * (981.0 / 8500);
}

// Whether n places of the first 2^bits points are all different in their highest bits.
bool are_spread(unsigned bits, std::size_t one, unsigned one_bits, std::size_t other) {
    std::set<unsigned> cells;
    for (unsigned n = 0; n < 1u << bits; n++) {
        const world::RayPoint &point = world::ray_points()[n];
        const unsigned other_bits = bits - one_bits;
        cells.insert(unsigned(point[one] >> (16 - one_bits)) << 8 |
                     unsigned(point[other] >> (16 - other_bits)));
    }
    return cells.size() == 1u << bits;
}

}  // namespace

TEST_CASE("places of rays are spread evenly over the pixel, the pupil, and both together") {
    constexpr std::size_t kX = 0, kY = 1, kU = 2, kV = 3;
    for (const unsigned bits : {2u, 4u, 6u}) {
        CHECK(are_spread(bits, kX, bits / 2, kY));
        CHECK(are_spread(bits, kU, bits / 2, kV));
    }
    for (const unsigned bits : {4u, 6u}) {
        CHECK(are_spread(bits, kX, bits / 2, kU));
        CHECK(are_spread(bits, kY, bits / 2, kV));
    }
    std::set<unsigned> quarters;
    for (unsigned n = 0; n < 16; n++) {
        unsigned quarter = 0;
        for (const std::uint16_t place : world::ray_points()[n]) {
            quarter = quarter << 1 | place >> 15;
        }
        quarters.insert(quarter);
    }
    CHECK(quarters.size() == 16);
    // Opposite to each other: XOR with any number keeps the mean.
    for (const std::size_t count : {4u, 16u, 64u}) {
        for (const unsigned key : {0u, 0x1234u, 0xFFFFu}) {
            for (std::size_t d = 0; d < 4; d++) {
                unsigned sum = 0;
                for (std::size_t n = 0; n < count; n++) {
                    sum += world::ray_points()[n][d] ^ key;
                }
                CHECK(2 * sum == count * 0xFFFF);
            }
        }
    }
}

TEST_CASE("outlines and ornaments stay as they are from frame to frame") {
    const world::Scene scene = world::load_scene(file("scenes/cylinder.yaml"));
    const world::Rig rig = rig_without_noise();
    // Sharp, and a little out of focus.
    for (const double focus_mm : {1800.0, 1650.0}) {
        world::FrameRequest request = request_at(rig, 322);
        world::Mechanics m = straight(rig, 322, focus_mm, 850);
        m.pan_rad = rig.camera[0].pan_rad;
        request.mechanics = [m](double) { return m; };
        request.exposure_us = 10000;
        request.window = {768, 576, 512, 384, 1, 1, 1, 1};
        request.seed = 1;
        const world::Frame a = world::render(scene, rig, world::Side::kLeft, request);
        request.seed = 2;
        const world::Frame b = world::render(scene, rig, world::Side::kLeft, request);
        int squares = 0, changed = 0;
        double largest = 0;
        for (int y = 0; y < a.rows; y += 4) {
            for (int x = 0; x < a.columns; x += 4) {
                double difference = 0, noise2 = 0;
                for (int i = 0; i < 16; i++) {
                    const auto at = static_cast<std::size_t>((y + i / 4) * a.columns + x + i % 4);
                    difference += a.pixels[at] - b.pixels[at];
                    noise2 += 2 * noise2_of(0.5 * (a.pixels[at] + b.pixels[at]));
                }
                squares++;
                changed += difference * difference > noise2 ? 1 : 0;
                largest = std::max(largest, std::fabs(difference) / std::sqrt(noise2));
            }
        }
        MESSAGE("focused at " << focus_mm << " mm: of " << squares << " squares " << changed
                              << " differ by more than their noise, one by " << largest);
        CHECK(changed < squares / 50);
        CHECK(largest < 4);
    }
}

TEST_CASE("other rays change a picture by less than its own noise") {
    for (const char *name : {"cylinder", "level", "figurine"}) {
        const world::Scene scene = world::load_scene(file(std::string("scenes/") + name + ".yaml"));
        const world::Rig rig = rig_without_noise();
        for (const double zoom : {300.0, 850.0}) {
            world::FrameRequest request = request_at(rig, zoom);
            request.window = {900, 640, 240, 240, 1, 1, 1, 1};
            request.seed = 1;
            const world::Frame a = world::render(scene, rig, world::Side::kLeft, request);
            request.seed = 2;
            const world::Frame b = world::render(scene, rig, world::Side::kLeft, request);
            double sum = 0;
            double relative = 0;
            for (std::size_t i = 0; i < a.pixels.size(); i++) {
                const double d = a.pixels[i] - b.pixels[i];
                sum += d;
                relative += std::max(0.5 * d * d - 1.0 / 12, 0.0) /
                            noise2_of(0.5 * (a.pixels[i] + b.pixels[i]));
            }
            const double n = static_cast<double>(a.pixels.size());
            MESSAGE(std::string(name)
                    << " at " << zoom << ": sampling " << std::sqrt(relative / n)
                    << " of the sensor's noise, mean difference " << sum / n << " DN");
            // Most of it is at outlines, where rays end at 128 a pixel.
            CHECK(std::sqrt(relative / n) < 0.6);
            CHECK(std::fabs(sum / n) < 0.05);
        }
    }
}

TEST_CASE("the spectrum of wall and panel has no lines") {
    world::Rig rig = perfect_rig();
    for (const double zoom : {300.0, 480.0, 850.0}) {
        const world::Scene scene = world::load_scene(file("scenes/plane.yaml"));
        world::FrameRequest request = request_at(rig, zoom);
        request.window = {768, 512, 512, 512, 1, 1, 1, 1};
        const double line =
            strongest_line(green_plane(world::render(scene, rig, world::Side::kLeft, request)));
        // The power of noise is exponential: the largest of 30,000 places is some 15 medians, and
        // where the spectrum is steep some more.
        MESSAGE("zoom " << zoom << ": strongest place of the spectrum " << line << " medians");
        CHECK(line < 40);
    }
}

TEST_CASE("no area is without texture, and none without noise") {
    const world::Rig perfect = perfect_rig();
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    const world::Scene scene = world::load_scene(file("scenes/still_life.yaml"));
    for (const double zoom : {300.0, 850.0}) {
        world::FrameRequest request = request_at(perfect, zoom);
        // Closed: out of focus nothing has texture, and rightly.
        request.window = {512, 512, 1024, 512, 1, 1, 1, 1};
        const cv::Mat clean =
            green_plane(world::render(scene, perfect, world::Side::kLeft, request));
        // The sensor's noise is everywhere the same: a quarter is enough.
        request.window = {768, 640, 512, 256, 1, 1, 1, 1};
        request.frame = 1;
        const cv::Mat a = green_plane(world::render(scene, rig, world::Side::kLeft, request));
        request.frame = 2;
        const cv::Mat b = green_plane(world::render(scene, rig, world::Side::kLeft, request));
        int plain = 0;
        int quiet = 0;
        int blocks = 0;
        for (int y = 0; y + 16 <= clean.rows; y += 16) {
            for (int x = 0; x + 16 <= clean.cols; x += 16) {
                const cv::Rect r(x, y, 16, 16);
                cv::Scalar mean;
                cv::Scalar deviation;
                cv::meanStdDev(clean(r), mean, deviation);
                plain += deviation[0] < 0.3;
                blocks++;
                if (y + 16 > a.rows || x + 16 > a.cols) {
                    continue;
                }
                cv::Mat difference = a(r) - b(r);
                cv::meanStdDev(difference, mean, deviation);
                quiet += deviation[0] < 0.8 && cv::mean(a(r))[0] < 1000;
            }
        }
        MESSAGE("zoom " << zoom << ": of " << blocks << " blocks " << plain << " plain, " << quiet
                        << " quiet");
        CHECK(quiet == 0);
        if (zoom < 400) {
            CHECK(plain <= blocks / 100);
        }
    }
}

TEST_CASE("a board's white squares do not end where its paper begins") {
    const world::Board board = {5, 4, 20, 0};
    for (const double filter_mm : {0.1, 1.0, 8.0}) {
        for (const double off_mm : {-3.0, -0.4, 0.0, 0.4, 3.0}) {
            // The right end of the top row's last square but one row: white next to white.
            const double x = 50 + off_mm;
            CHECK(world::board_white(board, {x, -10}, filter_mm, 0.3) == doctest::Approx(1));
        }
    }
    // And a black one ends there: half of the filter sees it.
    CHECK(world::board_white(board, {50, 10}, 1, 0.3) == doctest::Approx(0.5));
}

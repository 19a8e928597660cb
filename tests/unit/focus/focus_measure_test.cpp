// SPDX-License-Identifier: Apache-2.0
// The focus measures: against double arithmetic, without light, with noise only, and with blur.
#include "focus/focus_measure.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "synthetic/seed.hpp"

namespace {

constexpr focus_noise kNoNoise = {0, 0, 0};

struct Window {
    uint16_t width_px, height_px;
    std::vector<uint16_t> values;

    Window(uint16_t width, uint16_t height)
        : width_px(width), height_px(height), values(size_t{width} * height) {}
    uint16_t &at(int x, int y) { return values[size_t(y) * width_px + size_t(x)]; }
    focus_sharpness measure(focus_plane plane, focus_measure which,
                            const focus_noise &noise = kNoNoise) const {
        const focus_window window = {values.data(), width_px, width_px, height_px, 1023};
        return focus_measure_window(&window, plane, which, &noise);
    }
};

// The planes of a colour, each as rows of doubles.
std::vector<std::vector<std::vector<double>>> planes_of(Window &window, focus_plane plane) {
    const int step = plane == FOCUS_GREY ? 1 : 2;
    std::vector<std::pair<int, int>> firsts;
    switch (plane) {
        case FOCUS_GREEN:
            firsts = {{0, 0}, {1, 1}};
            break;
        case FOCUS_RED:
            firsts = {{1, 0}};
            break;
        case FOCUS_BLUE:
            firsts = {{0, 1}};
            break;
        default:
            firsts = {{0, 0}};
            break;
    }
    std::vector<std::vector<std::vector<double>>> result;
    for (const auto &[x0, y0] : firsts) {
        auto &rows = result.emplace_back();
        for (int y = y0; y < window.height_px; y += step) {
            auto &row = rows.emplace_back();
            for (int x = x0; x < window.width_px; x += step) {
                row.push_back(window.at(x, y));
            }
        }
    }
    return result;
}

double filtered(const std::vector<std::vector<double>> &v, size_t x, size_t y,
                const int (&weights)[3][3]) {
    double sum = 0;
    for (size_t j = 0; j < 3; j++) {
        for (size_t i = 0; i < 3; i++) {
            sum += weights[j][i] * v[y + j - 1][x + i - 1];
        }
    }
    return sum;
}

double energy(const std::vector<std::vector<double>> &v, focus_measure which) {
    const int sobel_x[3][3] = {{-1, 0, 1}, {-2, 0, 2}, {-1, 0, 1}};
    const int sobel_y[3][3] = {{-1, -2, -1}, {0, 0, 0}, {1, 2, 1}};
    const int laplacian[3][3] = {{0, -1, 0}, {-1, 4, -1}, {0, -1, 0}};
    double sum = 0, squares = 0, filter = 0;
    for (size_t y = 0; y < v.size(); y++) {
        for (size_t x = 0; x < v[y].size(); x++) {
            sum += v[y][x];
            squares += v[y][x] * v[y][x];
            if (x == 0 || y == 0 || y + 1 == v.size() || x + 1 == v[y].size()) {
                continue;
            }
            filter += which == FOCUS_LAPLACIAN ? std::pow(filtered(v, x, y, laplacian), 2)
                                               : std::pow(filtered(v, x, y, sobel_x), 2) +
                                                     std::pow(filtered(v, x, y, sobel_y), 2);
        }
    }
    const double count = double(v.size() * v[0].size());
    const double inner = double((v.size() - 2) * (v[0].size() - 2));
    const bool variance = which == FOCUS_VARIANCE || which == FOCUS_NORMALIZED_VARIANCE;
    return variance ? squares / count - sum / count * (sum / count) : filter / inner;
}

double unit_of(focus_measure which) {
    return which == FOCUS_NORMALIZED_VARIANCE ? std::exp2(double(FOCUS_NORMALIZED_SHIFT)) : 256;
}

// A mosaic of a random scene: blocks of random light, seen through a gaussian blur.
Window scene(std::mt19937_64 &random, double sigma_px) {
    constexpr int kSize = 100;
    std::uniform_real_distribution<double> shade(100, 800);
    std::vector<double> light(kSize * kSize), across(kSize * kSize);
    for (int y = 0; y < kSize; y++) {
        for (int x = 0; x < kSize; x++) {
            const bool first = x % 5 == 0 && y % 5 == 0;
            light[size_t(y * kSize + x)] =
                first ? shade(random) : light[size_t((y - y % 5) * kSize + x - x % 5)];
        }
    }
    const int reach = int(4 * sigma_px) + 1;
    const auto blur = [&](const std::vector<double> &from, int dx, int dy) {
        std::vector<double> to(from.size());
        for (int y = 0; y < kSize; y++) {
            for (int x = 0; x < kSize; x++) {
                double sum = 0, weights = 0;
                for (int i = -reach; i <= reach; i++) {
                    const int px = std::clamp(x + i * dx, 0, kSize - 1);
                    const int py = std::clamp(y + i * dy, 0, kSize - 1);
                    const double weight =
                        sigma_px == 0 ? i == 0 : std::exp(-i * i / (2 * sigma_px * sigma_px));
                    sum += weight * from[size_t(py * kSize + px)];
                    weights += weight;
                }
                to[size_t(y * kSize + x)] = sum / weights;
            }
        }
        return to;
    };
    light = blur(blur(light, 1, 0), 0, 1);
    Window window(kSize, kSize);
    constexpr double kFilters[2][2] = {{1, 0.6}, {0.4, 0.97}};
    for (int y = 0; y < kSize; y++) {
        for (int x = 0; x < kSize; x++) {
            window.at(x, y) =
                uint16_t(std::lround(light[size_t(y * kSize + x)] * kFilters[y % 2][x % 2]));
        }
    }
    return window;
}

constexpr focus_measure kMeasures[] = {FOCUS_VARIANCE, FOCUS_NORMALIZED_VARIANCE, FOCUS_TENENGRAD,
                                       FOCUS_LAPLACIAN};

}  // namespace

TEST_CASE("every measure of every plane agrees with double arithmetic") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 40; i++) {
        Window window(uint16_t(8 + 2 * (random() % 40)), uint16_t(8 + 2 * (random() % 40)));
        const unsigned max = i % 2 == 0 ? 1023 : 4095;
        for (uint16_t &value : window.values) {
            value = uint16_t(random() % (max + 1));
        }
        for (const focus_plane plane : {FOCUS_GREEN, FOCUS_RED, FOCUS_BLUE, FOCUS_GREY}) {
            const auto planes = planes_of(window, plane);
            double mean = 0, count = 0;
            for (const auto &rows : planes) {
                for (const auto &row : rows) {
                    for (const double value : row) {
                        mean += value;
                        count++;
                    }
                }
            }
            mean /= count;
            for (const focus_measure which : kMeasures) {
                double expected = 0;
                for (const auto &rows : planes) {
                    expected += energy(rows, which) / double(planes.size());
                }
                if (which == FOCUS_NORMALIZED_VARIANCE) {
                    expected /= mean * mean;
                }
                const focus_sharpness found = window.measure(plane, which);
                CHECK(found.samples == uint32_t(count));
                CHECK(std::fabs(double(found.mean_q8) / 256 - mean) < 1.0 / 256);
                CHECK(double(found.energy) / unit_of(which) ==
                      doctest::Approx(expected).epsilon(1e-4));
                CHECK(found.noise_energy == 0);
            }
        }
    }
}

TEST_CASE("the largest values and windows do not overflow") {
    Window window(FOCUS_WINDOW_MAX_PX, FOCUS_WINDOW_MAX_PX);
    for (int y = 0; y < window.height_px; y++) {
        for (int x = 0; x < window.width_px; x++) {
            window.at(x, y) = (x + y) % 2 == 0 ? 0 : UINT16_MAX;  // cut off at 4095
        }
    }
    const double peak = 4095;
    const uint64_t variance = window.measure(FOCUS_GREY, FOCUS_VARIANCE).energy;
    CHECK(double(variance) == doctest::Approx(256 * peak * peak / 4).epsilon(1e-3));
    const uint64_t laplacian = window.measure(FOCUS_GREY, FOCUS_LAPLACIAN).energy;
    CHECK(double(laplacian) == doctest::Approx(256 * 16 * peak * peak).epsilon(1e-3));
    CHECK(window.measure(FOCUS_GREY, FOCUS_TENENGRAD).energy == 0);  // Sobel does not see it
    CHECK(window.measure(FOCUS_GREEN, FOCUS_VARIANCE).energy == 0);
    CHECK(window.measure(FOCUS_GREY, FOCUS_VARIANCE).saturated_permille == 500);
}

TEST_CASE("a flat scene behind colour filters has no contrast in any plane but all together") {
    Window window(64, 64);
    for (int y = 0; y < 64; y++) {
        for (int x = 0; x < 64; x++) {
            window.at(x, y) =
                uint16_t(y % 2 == 0 ? (x % 2 == 0 ? 500 : 300) : (x % 2 == 0 ? 200 : 490));
        }
    }
    for (const focus_measure which : kMeasures) {
        CHECK(window.measure(FOCUS_GREEN, which).energy == 0);
        CHECK(window.measure(FOCUS_RED, which).energy == 0);
        CHECK(window.measure(FOCUS_BLUE, which).energy == 0);
        // Sobel's weights cancel a pattern that repeats every two pixels.
        CHECK((window.measure(FOCUS_GREY, which).energy > 0) == (which != FOCUS_TENENGRAD));
    }
}

TEST_CASE("what noise contributes is subtracted, at any gain and light") {
    std::mt19937_64 random(synthetic::test_seed());
    constexpr focus_noise kUnity = {42, 256, 7700};  // 1 value^2, and 0.117 per value
    for (const uint16_t gain_q3 : {uint16_t{8}, uint16_t{16}, uint16_t{64}}) {
        const focus_noise noise = focus_noise_at(&kUnity, gain_q3);
        for (const double light : {20.0, 300.0, 500.0}) {
            for (const focus_measure which : kMeasures) {
                double raw = 0, left = 0;
                constexpr int kWindows = 30;
                for (int i = 0; i < kWindows; i++) {
                    Window window(100, 100);
                    const double sigma =
                        std::sqrt(noise.read_q8 / 256.0 + light * noise.shot_q16 / 65536.0);
                    std::normal_distribution<double> draw(42 + light, sigma);
                    for (uint16_t &value : window.values) {
                        value = uint16_t(std::clamp(std::lround(draw(random)), 0L, 1023L));
                    }
                    const focus_sharpness found = window.measure(FOCUS_GREEN, which, noise);
                    raw += double(found.energy + found.noise_energy) / kWindows;
                    left += double(found.energy) / kWindows;
                }
                INFO("gain ", gain_q3 / 8, " light ", light, " measure ", int(which));
                // Clipping at 0 leaves half of the estimate's own scatter; a value's rounding adds
                // 1/12 of a squared value.
                CHECK(left < 0.12 * raw);
            }
        }
    }
}

TEST_CASE("each measure falls with blur, and the normalized one ignores the light") {
    std::mt19937_64 random(synthetic::test_seed());
    const uint64_t seed = random();
    for (const focus_measure which : kMeasures) {
        uint64_t before = UINT64_MAX;
        for (const double sigma_px : {0.0, 0.7, 1.5, 3.0, 6.0}) {
            std::mt19937_64 same(seed);
            const uint64_t now = scene(same, sigma_px).measure(FOCUS_GREEN, which).energy;
            INFO("measure ", int(which), " sigma ", sigma_px);
            CHECK(now < before);
            before = now;
        }
    }
    std::mt19937_64 same(seed);
    Window bright = scene(same, 1), dim = bright;
    for (uint16_t &value : dim.values) {
        value = uint16_t((value + 1) / 2);
    }
    const auto ratio = [&](focus_measure which) {
        return double(dim.measure(FOCUS_GREEN, which).energy) /
               double(bright.measure(FOCUS_GREEN, which).energy);
    };
    CHECK(ratio(FOCUS_NORMALIZED_VARIANCE) == doctest::Approx(1).epsilon(0.02));
    CHECK(ratio(FOCUS_VARIANCE) == doctest::Approx(0.25).epsilon(0.02));
}

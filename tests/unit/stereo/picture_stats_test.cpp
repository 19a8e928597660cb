// SPDX-License-Identifier: Apache-2.0
// The four numbers of a picture: light, and sharpness independent of light.
#include "stereo/image/picture_stats.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "synthetic/seed.hpp"

namespace {

constexpr int kWidth = 256, kHeight = 96;

using Picture = std::vector<double>;  // light, 0 .. 1

// Bars of random widths and shades, like real objects.
Picture bars(std::mt19937_64 &random) {
    std::uniform_real_distribution<double> shade(0.1, 0.9);
    std::uniform_int_distribution<int> bar(2, 24);
    Picture light(size_t(kWidth) * kHeight);
    for (int y = 0; y < kHeight; y++) {
        for (int x = 0; x < kWidth;) {
            const double value = shade(random);
            for (int end = std::min(kWidth, x + bar(random)); x < end; x++) {
                light[size_t(y) * kWidth + size_t(x)] = value;
            }
        }
    }
    return light;
}

// Along the rows, by a gaussian.
Picture blurred(const Picture &light, double sigma_px) {
    Picture result(light.size());
    const int reach = int(4 * sigma_px) + 1;
    for (int y = 0; y < kHeight; y++) {
        for (int x = 0; x < kWidth; x++) {
            double sum = 0, weights = 0;
            for (int i = -reach; i <= reach; i++) {
                const double weight = std::exp(-i * i / (2 * sigma_px * sigma_px));
                sum +=
                    weight * light[size_t(y) * kWidth + size_t(std::clamp(x + i, 0, kWidth - 1))];
                weights += weight;
            }
            result[size_t(y) * kWidth + size_t(x)] = sum / weights;
        }
    }
    return result;
}

std::vector<uint16_t> exposed(const Picture &light, double gain, int bits, double noise,
                              std::mt19937_64 &random) {
    std::normal_distribution<double> normal(0, 1);
    const double full = (1 << bits) - 1;
    std::vector<uint16_t> values;
    for (const double part : light) {
        const double value = (part * gain + noise * normal(random)) * full;
        values.push_back(uint16_t(std::clamp(std::round(value), 0.0, full)));
    }
    return values;
}

picture_stats assessed(const std::vector<uint16_t> &values, const picture_form &form) {
    picture_stats_sums sums;
    picture_stats_begin(&sums, &form);
    const size_t row = size_t(form.width_px) * size_t(form.channels);
    for (size_t at = 0; at + row <= values.size(); at += row) {
        picture_stats_row(&sums, values.data() + at);
    }
    return picture_stats_end(&sums);
}

constexpr picture_form kGrey8 = {kWidth, 8, 1, false};

}  // namespace

TEST_CASE("light is counted in parts of a thousand of all values") {
    std::vector<uint16_t> values(size_t(kWidth) * kHeight, 0);
    CHECK(assessed(values, kGrey8).brightness_permille == 0);
    CHECK(assessed(values, kGrey8).black_permille == 1000);
    CHECK(assessed(values, kGrey8).saturated_permille == 0);
    CHECK(assessed(values, kGrey8).sharpness_permille == 0);
    std::fill(values.begin(), values.end(), 255);
    CHECK(assessed(values, kGrey8).brightness_permille == 1000);
    CHECK(assessed(values, kGrey8).black_permille == 0);
    CHECK(assessed(values, kGrey8).saturated_permille == 1000);
    CHECK(assessed(values, kGrey8).sharpness_permille == 0);
    // A quarter at the last value that counts as black, a quarter at the first that counts as
    // saturated.
    for (size_t i = 0; i < values.size(); i++) {
        values[i] = i % 4 == 0 ? 3 : i % 4 == 1 ? 252 : i % 4 == 2 ? 4 : 251;
    }
    CHECK(assessed(values, kGrey8).brightness_permille == 500);
    CHECK(assessed(values, kGrey8).black_permille == 250);
    CHECK(assessed(values, kGrey8).saturated_permille == 250);
    // Of 16 bits, the largest sums.
    std::vector<uint16_t> wide(size_t(4096) * 8, UINT16_MAX);
    for (size_t i = 0; i < wide.size(); i += 4) {
        wide[i] = wide[i + 1] = 0;
    }
    const picture_stats stats = assessed(wide, {4096, 16, 1, false});
    CHECK(stats.brightness_permille == 500);
    CHECK(stats.black_permille == 500);
    CHECK(stats.saturated_permille == 500);
    CHECK(stats.sharpness_permille == 1000);
}

TEST_CASE("sharpness is the largest step's part of the contrast") {
    std::vector<uint16_t> values(kWidth);
    for (int x = 0; x < kWidth; x++) {
        values[size_t(x)] = x % 32 < 16 ? 10 : 200;
    }
    CHECK(assessed(values, kGrey8).sharpness_permille == 1000);
    for (int x = 0; x < kWidth; x++) {
        values[size_t(x)] = uint16_t(6 * (x % 32));  // 15 equal steps
    }
    CHECK(assessed(values, kGrey8).sharpness_permille == 67);
    // Weak edges next to strong ones hardly count: 100 of 100 against 2 of 30 steps.
    for (int x = 0; x < kWidth; x++) {
        values[size_t(x)] = uint16_t(x < kWidth / 2 ? (x % 32 < 16 ? 0 : 100) : x % 32 / 16);
    }
    CHECK(assessed(values, kGrey8).sharpness_permille == 1000);
    CHECK(assessed(values, {31, 8, 1, false}).sharpness_permille == 0);
}

TEST_CASE("sharpness falls with blur and stays with light, depth and noise") {
    std::mt19937_64 random(synthetic::test_seed());
    const Picture light = bars(random);
    const int sharp = assessed(exposed(light, 1, 8, 0, random), kGrey8).sharpness_permille;
    CHECK(sharp > 500);
    for (const int bits : {8, 10, 12, 16}) {
        for (const double gain : {1.0, 0.3, 0.1}) {
            for (const double noise : {0.0, 0.01}) {
                CAPTURE(bits);
                CAPTURE(gain);
                CAPTURE(noise);
                const picture_form form = {kWidth, bits, 1, false};
                const auto values = exposed(light, gain, bits, noise * gain, random);
                CHECK(assessed(values, form).sharpness_permille ==
                      doctest::Approx(sharp).epsilon(0.05));
                CHECK(assessed(values, form).brightness_permille ==
                      doctest::Approx(500 * gain).epsilon(0.05));
            }
        }
    }
    int before = sharp;
    for (const double sigma_px : {1.0, 2.0, 4.0, 8.0}) {
        const Picture soft = blurred(light, sigma_px);
        const int bright = assessed(exposed(soft, 1, 8, 0.004, random), kGrey8).sharpness_permille;
        const int dim = assessed(exposed(soft, 0.2, 8, 0.0008, random), kGrey8).sharpness_permille;
        CAPTURE(sigma_px);
        CHECK(bright < 0.9 * before);
        CHECK(dim == doctest::Approx(bright).epsilon(0.08));
        before = bright;
    }
    CHECK(before < sharp / 3);
}

TEST_CASE("mosaics and colours are as sharp as the same picture in grey") {
    std::mt19937_64 random(synthetic::test_seed());
    const auto grey = exposed(blurred(bars(random), 1.5), 1, 10, 0.002, random);
    const picture_stats of_grey = assessed(grey, {kWidth, 10, 1, false});
    std::vector<uint16_t> mosaic = grey, rgb;
    for (int y = 0; y < kHeight; y++) {
        for (int x = 0; x < kWidth; x++) {
            const size_t at = size_t(y) * kWidth + size_t(x);
            const bool green = x % 2 == y % 2;
            mosaic[at] = green ? grey[at] : uint16_t(grey[at] / 4);
            rgb.insert(rgb.end(), {uint16_t(grey[at] / 4), grey[at], uint16_t(grey[at] / 4)});
        }
    }
    const picture_stats of_mosaic = assessed(mosaic, {kWidth, 10, 1, true});
    const picture_stats of_rgb = assessed(rgb, {kWidth, 10, 3, false});
    CHECK(of_mosaic.sharpness_permille ==
          doctest::Approx(of_grey.sharpness_permille).epsilon(0.12));
    CHECK(of_rgb.sharpness_permille == of_grey.sharpness_permille);
    CHECK(of_mosaic.brightness_permille ==
          doctest::Approx(0.625 * of_grey.brightness_permille).epsilon(0.02));
    CHECK(of_rgb.brightness_permille ==
          doctest::Approx(0.5 * of_grey.brightness_permille).epsilon(0.02));
}

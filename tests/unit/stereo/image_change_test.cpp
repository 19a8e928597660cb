// SPDX-License-Identifier: Apache-2.0
// What counts as a change between two pictures of one camera: motion, but not noise.
#include "stereo/image/image_change.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "synthetic/seed.hpp"

namespace {

constexpr uint32_t kWidth = 256, kHeight = 192;

using Picture = std::vector<double>;

// Light of 0 .. 1 in stripes `period` values wide.
Picture stripes(double period, double low, double high, double shift = 0) {
    Picture light(size_t(kWidth) * kHeight);
    for (uint32_t row = 0; row < kHeight; row++) {
        for (uint32_t column = 0; column < kWidth; column++) {
            const double phase = (double(column) + shift + 0.3 * double(row)) / period;
            light[size_t(row) * kWidth + column] =
                low + (high - low) * (0.5 + 0.5 * std::sin(6.283185307 * phase));
        }
    }
    return light;
}

// As delivered by a sensor with a well of 8500 electrons and a read noise of 8, at this gain and
// depth.
std::vector<uint16_t> exposed(const Picture &light, double gain, unsigned bits,
                              std::mt19937_64 &random) {
    std::vector<uint16_t> values;
    std::normal_distribution<double> noise(0, 1);
    const double max = double((1u << bits) - 1), per_e = gain * max / 8500;
    for (const double part : light) {
        const double electrons = part * 8500 / gain;
        const double value = (electrons + std::sqrt(electrons + 64) * noise(random)) * per_e;
        values.push_back(uint16_t(std::clamp(std::round(value + 0.04 * max), 0.0, max)));
    }
    return values;
}

uint32_t change_of(const std::vector<uint16_t> &before, const std::vector<uint16_t> &after,
                   int width_px, int height_px, int bits, uint16_t gain_q3) {
    const raw_image one{before.data(), width_px, height_px, width_px,
                        bits,          RAW_GREY, nullptr,   nullptr};
    raw_image other = one;
    other.data = after.data();
    return image_change_permille(&one, &other, gain_q3);
}

uint32_t change(const std::vector<uint16_t> &before, const std::vector<uint16_t> &after,
                unsigned bits, double gain) {
    return change_of(before, after, kWidth, kHeight, int(bits), uint16_t(8 * gain));
}

}  // namespace

TEST_CASE("noise does not count as change, at any light, gain and depth") {
    std::mt19937_64 random(synthetic::test_seed());
    for (const double gain : {1.0, 2.0, 8.0, 32.0}) {
        for (const unsigned bits : {8u, 10u, 12u}) {
            for (const double high : {0.02, 0.3, 0.9}) {
                const Picture light = stripes(40, 0.01, high);
                CAPTURE(gain);
                CAPTURE(bits);
                CAPTURE(high);
                const auto before = exposed(light, gain, bits, random);
                const auto after = exposed(light, gain, bits, random);
                CHECK(change(before, after, bits, gain) == 0);
            }
        }
    }
}

TEST_CASE("what moves by a pixel is found where there is contrast") {
    std::mt19937_64 random(synthetic::test_seed());
    const auto before = exposed(stripes(24, 0.1, 0.7), 1, 10, random);
    const auto after = exposed(stripes(24, 0.1, 0.7, 1.0), 1, 10, random);
    CHECK(change(before, after, 10, 1) > 300);
    // A tenth of a tenth of the picture.
    auto some = before;
    std::copy(after.begin(), after.begin() + kWidth * (kHeight / 10), some.begin());
    const uint32_t part = change(before, some, 10, 1);
    CHECK(part > 30);
    CHECK(part < 110);
}

TEST_CASE("light that changes by a tenth is found") {
    std::mt19937_64 random(synthetic::test_seed());
    const auto before = exposed(stripes(24, 0.3, 0.7), 1, 10, random);
    Picture brighter = stripes(24, 0.3, 0.7);
    for (double &part : brighter) {
        part *= 1.1;
    }
    CHECK(change(before, exposed(brighter, 1, 10, random), 10, 1) > 900);
}

TEST_CASE("pictures smaller than a square have nothing that changes") {
    const std::vector<uint16_t> black(9, 0), white(9, 1023);
    CHECK(change_of(black, white, 3, 3, 10, 8) == 0);
}

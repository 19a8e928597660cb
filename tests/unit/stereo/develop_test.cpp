// SPDX-License-Identifier: Apache-2.0
// White stays white under coloured light, and the grey image for matching does not change.
#include "stereo/develop.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <random>
#include <vector>

#include "core/error.h"
#include "synthetic/seed.hpp"
#include "synthetic/threads.hpp"

namespace {

constexpr int kWidth = 96, kHeight = 64, kBits = 10;

using Colour = std::array<double, 3>;

struct Developed {
    std::vector<uint8_t> grey = std::vector<uint8_t>(kWidth * kHeight);
    std::vector<uint8_t> colour = std::vector<uint8_t>(3 * kWidth * kHeight);
};

// Grey patches of 0.1 to 0.6 of the largest value, and some coloured ones, in this light.
std::vector<uint16_t> mosaic(const Colour &light, const Colour &thing, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<uint16_t> values(kWidth * kHeight);
    std::vector<double> patches(kWidth / 8 * kHeight / 8);
    for (double &patch : patches) {
        patch = std::uniform_real_distribution<>(0.1, 0.6)(random);
    }
    for (int y = 0; y < kHeight; y++) {
        for (int x = 0; x < kWidth; x++) {
            const size_t channel = y % 2 == 0 ? (x % 2 == 0 ? 1 : 0) : (x % 2 == 0 ? 2 : 1);
            const bool of_thing = x < kWidth / 4;
            const double patch = patches[static_cast<size_t>(y / 8 * (kWidth / 8) + x / 8)];
            values[static_cast<size_t>(y * kWidth + x)] = static_cast<uint16_t>(
                patch * light[channel] * (of_thing ? thing[channel] : 1) * 1023);
        }
    }
    return values;
}

raw_image image_of(const std::vector<uint16_t> &values, raw_layout layout) {
    return {values.data(), kWidth, kHeight, kWidth, kBits, layout, nullptr, nullptr};
}

Developed develop(const raw_image &raw, const develop_balance &balance) {
    Developed out;
    synthetic::Threads threads(2);
    std::vector<uint8_t> memory(develop_need_bytes(kWidth, kBits, 2));
    struct arena arena;
    arena_init(&arena, memory.data(), memory.size());
    image_u8 grey = {out.grey.data(), kWidth, kHeight, kWidth};
    image_rgb8 colour = {out.colour.data(), kWidth, kHeight, 3 * kWidth};
    REQUIRE(develop_image(&raw, &balance, threads.parallel(), &arena, &grey, &colour) == ERROR_OK);
    return out;
}

// Largest difference between channels within the grey part, away from the patches' edges.
int cast_of(const Developed &developed) {
    int worst = 0;
    for (int y = 4; y < kHeight; y += 8) {
        for (int x = kWidth / 4 + 4; x < kWidth; x += 8) {
            const uint8_t *pixel = &developed.colour[static_cast<size_t>(3 * (y * kWidth + x))];
            worst = std::max({worst, std::abs(pixel[0] - pixel[1]), std::abs(pixel[2] - pixel[1])});
        }
    }
    return worst;
}

}  // namespace

TEST_CASE("grey things are grey in coloured light") {
    const uint64_t seed = synthetic::test_seed();
    for (const Colour &light : {Colour{0.55, 1, 0.7}, Colour{1, 0.8, 0.4}, Colour{0.9, 1, 0.95}}) {
        const std::vector<uint16_t> values = mosaic(light, {1, 1, 1}, seed);
        const raw_image raw = image_of(values, RAW_BAYER_GRBG);
        const develop_balance none = {{256, 256, 256}};
        const develop_balance found = develop_balance_of(&raw);
        CHECK(cast_of(develop(raw, found)) <= 3);
        CHECK(cast_of(develop(raw, none)) > 3);
        CHECK(develop(raw, found).grey == develop(raw, none).grey);
    }
}

TEST_CASE("a quarter of the picture of one colour changes little") {
    const std::vector<uint16_t> values =
        mosaic({0.6, 1, 0.7}, {1, 0.2, 0.1}, synthetic::test_seed());
    const raw_image raw = image_of(values, RAW_BAYER_GRBG);
    // Grey world, which uses plain means, is off by about 20 here.
    CHECK(cast_of(develop(raw, develop_balance_of(&raw))) <= 16);
}

TEST_CASE("no light of one colour, no light at all, no mosaic") {
    const std::vector<uint16_t> green = mosaic({0, 1, 0}, {1, 1, 1}, 1);
    raw_image raw = image_of(green, RAW_BAYER_GRBG);
    develop_balance balance = develop_balance_of(&raw);
    CHECK(balance.gain_q8[0] == 4 * DEVELOP_BALANCE_ONE);
    CHECK(balance.gain_q8[1] == DEVELOP_BALANCE_ONE);
    CHECK(balance.gain_q8[2] == 4 * DEVELOP_BALANCE_ONE);
    const std::vector<uint16_t> dark(kWidth * kHeight);
    raw = image_of(dark, RAW_BAYER_GRBG);
    balance = develop_balance_of(&raw);
    CHECK(balance.gain_q8[0] >= DEVELOP_BALANCE_ONE);
    CHECK(develop(raw, balance).colour == std::vector<uint8_t>(3 * kWidth * kHeight));
    raw = image_of(green, RAW_GREY);
    balance = develop_balance_of(&raw);
    for (const uint16_t gain : balance.gain_q8) {
        CHECK(gain == DEVELOP_BALANCE_ONE);
    }
}

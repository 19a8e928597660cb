// SPDX-License-Identifier: Apache-2.0
// What is kept and rejected by what is around a pixel, of whole pairs.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "stereo/match/match.h"
#include "synthetic/matched.hpp"
#include "synthetic/seed.hpp"

using namespace synthetic;

TEST_CASE("structure along the rows is not measured, however strong") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    constexpr int kWidth = 256, kHeight = 160;
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<int> bright(90, 140);
    std::normal_distribution<double> noise(0, 1);
    for (int round = 0; round < 8; round++) {
        // Every row of one grey level, as the grain of a table that lies along the rows.
        std::vector<uint8_t> left, right;
        for (int y = 0; y < kHeight; y++) {
            const int grey = bright(random);
            for (int x = 0; x < kWidth; x++) {
                left.push_back(static_cast<uint8_t>(grey + std::lround(noise(random))));
                right.push_back(static_cast<uint8_t>(grey + std::lround(noise(random))));
            }
        }
        for (const match_preset preset : {MATCH_PRESET_STANDARD, MATCH_PRESET_BEST}) {
            match_options options = match_default_options(0, 32);
            options.preset = preset;
            const Matched matched = run_match(left, right, kWidth, kHeight, options);
            REQUIRE(matched.status == ERROR_OK);
            CHECK(matched.share(REASON_VALID) < 0.02);
        }
    }
}

// What is clipped has no noise, and would make the noise of the rest pass for texture.
TEST_CASE("noise is not texture beside a clipped surface") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    constexpr int kWidth = 320, kHeight = 160, kClipped = 160;
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<int> bright(108, 112);
    std::uniform_int_distribution<int> dark(-400, 80);
    std::normal_distribution<double> noise(0, 1);
    std::vector<uint8_t> left, right;
    for (int y = 0; y < kHeight; y++) {
        const int grey = bright(random);
        for (int x = 0; x < kWidth; x++) {
            const int dot = 255 - std::max(dark(random), 0);
            left.push_back(
                static_cast<uint8_t>(x < kClipped ? dot : grey + std::lround(noise(random))));
            right.push_back(
                static_cast<uint8_t>(x < kClipped ? dot : grey + std::lround(noise(random))));
        }
    }
    match_options options = match_default_options(-16, 32);
    options.preset = MATCH_PRESET_BEST;
    const Matched matched = run_match(left, right, kWidth, kHeight, options);
    REQUIRE(matched.status == ERROR_OK);
    int clipped = 0, kept = 0;
    for (int y = 0; y < kHeight; y++) {
        for (int x = 20; x < kWidth - 20; x++) {
            clipped += x < kClipped - 20 && matched.valid(matched.index(x, y));
            kept += x >= kClipped + 20 && matched.valid(matched.index(x, y));
        }
    }
    CAPTURE(clipped);
    CAPTURE(kept);
    CHECK(clipped > 0.9 * (kClipped - 40) * kHeight);
    CHECK(kept < 0.05 * (kWidth - kClipped - 40) * kHeight);
}

TEST_CASE("the grain that an object hides is not kept at the object's depth") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    constexpr int kWidth = 320, kHeight = 160, kFar = 8, kNear = 32;
    constexpr double kFaint = 1;
    // A bright object with spots, in front of a table whose grain lies along the rows, with
    // little texture beside.
    constexpr int kLeft = 140, kRight = 240, kTop = 30, kBottom = 130, kRim = 8;
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<int> bright(70, 110);
    std::uniform_int_distribution<int> spot(-30, 10);
    std::normal_distribution<double> noise(0, 1);
    std::vector<uint8_t> left, right;
    for (int y = 0; y < kHeight; y++) {
        std::vector<int> object(kRight - kLeft);
        for (int &grey : object) {
            grey = 200 + spot(random);
        }
        const int grain = bright(random);
        std::vector<double> table(kWidth + kFar);
        for (size_t x = 1; x < table.size(); x++) {
            table[x] = 0.8 * table[x - 1] + kFaint * noise(random);
        }
        const bool inside = y >= kTop && y < kBottom;
        for (int x = 0; x < kWidth; x++) {
            const int left_x = x - kLeft, right_x = x + kNear - kLeft, width = kRight - kLeft;
            const bool in_left = inside && left_x >= 0 && left_x < width;
            const bool in_right = inside && right_x >= 0 && right_x < width;
            const double grey[2] = {in_left ? object[static_cast<size_t>(left_x)]
                                            : grain + table[static_cast<size_t>(x)],
                                    in_right ? object[static_cast<size_t>(right_x)]
                                             : grain + table[static_cast<size_t>(x + kFar)]};
            left.push_back(static_cast<uint8_t>(std::lround(grey[0] + noise(random))));
            right.push_back(static_cast<uint8_t>(std::lround(grey[1] + noise(random))));
        }
    }
    for (const match_preset preset : {MATCH_PRESET_STANDARD, MATCH_PRESET_BEST}) {
        match_options options = match_default_options(0, 48);
        options.preset = preset;
        const Matched matched = run_match(left, right, kWidth, kHeight, options);
        REQUIRE(matched.status == ERROR_OK);
        int hidden = 0, rim = 0, object = 0;
        for (int y = kTop + 4; y < kBottom - 4; y++) {
            const auto row = matched.reason.begin() + y * kWidth;
            hidden += static_cast<int>(
                std::count(row + kLeft - (kNear - kFar), row + kLeft, REASON_VALID));
            rim += static_cast<int>(std::count(row + kLeft, row + kLeft + kRim, REASON_VALID));
            object += static_cast<int>(std::count(row + kLeft, row + kRight, REASON_VALID));
        }
        const int rows = kBottom - kTop - 8;
        const double hidden_px = static_cast<double>(hidden) / rows;
        MESSAGE(std::string(match_preset_name(preset)), ": ", hidden_px,
                " hidden pixels of a row are kept");
        CHECK(hidden_px < 4);
        CHECK(rim > 0.8 * rows * kRim);
        CHECK(object > 0.9 * rows * (kRight - kLeft));
    }
}

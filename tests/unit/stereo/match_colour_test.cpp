// SPDX-License-Identifier: Apache-2.0
// What the matcher makes of images in colour.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "stereo/match/match.h"
#include "synthetic/matched.hpp"

using namespace synthetic;

namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr int kPixels = kWidth * kHeight;

struct Colours {
    std::vector<uint8_t> left, right;  // red, green and blue; empty: none
};

// Disparities of grey images, with these colours.
std::vector<int32_t> matched(const std::vector<uint8_t> &left, const std::vector<uint8_t> &right,
                             Colours colours, match_preset preset) {
    match_options options = match_default_options(0, 32);
    options.keep_all = true;
    options.preset = preset;
    Matched m = run_match(left, right, kWidth, kHeight, options);
    m.bind();
    const Memory memory(m.need_bytes);
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    if (!colours.left.empty()) {
        m.input.left_colour = {colours.left.data(), kWidth, kHeight, 3 * kWidth};
    }
    if (!colours.right.empty()) {
        m.input.right_colour = {colours.right.data(), kWidth, kHeight, 3 * kWidth};
    }
    REQUIRE(match_run(&m.input, &options, &parallel_serial, nullptr, nullptr, &arena, &m.output) ==
            ERROR_OK);
    return m.disparity_q8;
}

int count_wrong(const std::vector<int32_t> &disparity_q8, const std::vector<int> &truth) {
    int count = 0;
    for (size_t i = 0; i < truth.size(); i++) {
        count += std::abs(disparity_q8[i] - 256 * truth[i]) > 256;
    }
    return count;
}

constexpr match_preset kPresets[] = {MATCH_PRESET_FAST, MATCH_PRESET_STANDARD, MATCH_PRESET_BEST,
                                     MATCH_PRESET_BOARD};

}  // namespace

TEST_CASE("colour shows edges that grey hides, and equal channels are grey") {
    // A square in front of a background of the same grey.
    std::mt19937 random(7);
    std::vector<uint8_t> left(kPixels), right(kPixels), grey, red, right_grey;
    std::vector<int> truth;
    for (uint8_t &pixel : right) {
        pixel = static_cast<uint8_t>(126 + random() % 5);
        right_grey.insert(right_grey.end(), 3, pixel);
    }
    for (int i = 0; i < kPixels; i++) {
        const int x = i % kWidth, y = i / kWidth;
        const bool inside = x >= 40 && x < 72 && y >= 16 && y < 48;
        truth.push_back(inside ? 12 : 4);
        const uint8_t pixel = right[static_cast<size_t>(i - std::min(x, truth.back()))];
        left[static_cast<size_t>(i)] = pixel;
        grey.insert(grey.end(), 3, pixel);
        red.insert(red.end(), {static_cast<uint8_t>(pixel + (inside ? 60 : 0)), pixel, pixel});
    }
    const match_preset preset = MATCH_PRESET_STANDARD;
    const std::vector<int32_t> without = matched(left, right, {}, preset);
    CHECK(matched(left, right, {grey, right_grey}, preset) == without);
    const std::vector<int32_t> with = matched(left, right, {red, {}}, preset);
    CHECK(count_wrong(with, truth) < 0.8 * count_wrong(without, truth));
    // Colour of one image only is not compared.
    CHECK(matched(left, right, {red, right_grey}, preset) == with);
    CHECK(matched(left, right, {{}, red}, preset) == without);
    CHECK(matched(left, right, {grey, red}, preset) == without);
}

TEST_CASE("a pattern of colours of equal brightness is matched") {
    std::mt19937 random(9);
    const std::vector<uint8_t> grey(kPixels, 128);
    Colours colours;
    std::vector<int> truth;
    for (int i = 0; i < kPixels; i++) {
        const int warm = static_cast<int>(random() % 100);
        colours.right.insert(colours.right.end(), {static_cast<uint8_t>(78 + warm),
                                                   static_cast<uint8_t>(178 - warm), 128});
    }
    for (int i = 0; i < kPixels; i++) {
        const int x = i % kWidth;
        truth.push_back(x < kWidth / 2 ? 6 : 15);
        const auto from = colours.right.begin() + 3 * (i - std::min(x, truth.back()));
        colours.left.insert(colours.left.end(), from, from + 3);
    }
    for (const match_preset preset : kPresets) {
        const std::string name = match_preset_name(preset);
        CAPTURE(name);
        const Colours left_only = {colours.left, {}};
        CHECK(count_wrong(matched(grey, grey, left_only, preset), truth) > kPixels / 2);
        const int wrong = count_wrong(matched(grey, grey, colours, preset), truth);
        MESSAGE(name, ": ", wrong, " of ", kPixels, " wrong");
        CHECK(wrong < kPixels / 6);  // wrong pixels are at the left border and at the step
    }
}

// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>

#include "calibration_examples.hpp"
#include "core/error.h"
#include "stereo/geometry/calibration.h"
#include "synthetic/seed.hpp"

using namespace calibration_examples;

namespace {

template <size_t Size>
void random_text(Random &random, char (&text)[Size], const std::string &letters, int min) {
    const int length = whole(random, min, static_cast<int>(Size) - 1);
    std::memset(text, 0, Size);
    for (int i = 0; i < length; i++) {
        text[i] =
            letters[static_cast<size_t>(whole(random, 0, static_cast<int>(letters.size()) - 1))];
    }
}

lens random_lens(Random &random) {
    lens result{};
    result.width_px = whole(random, 1, 4096);
    result.height_px = whole(random, 1, 4096);
    const double widest = std::max(result.width_px, result.height_px);
    result.fx_px = widest * std::pow(10.0, uniform(random, -0.2, 1.5));
    result.fy_px = result.fx_px * uniform(random, 0.9, 1.1);
    result.cx_px = result.width_px * uniform(random, -0.1, 1.1);
    result.cy_px = result.height_px * uniform(random, -0.1, 1.1);
    // Radius of the farthest corner; distortion of a few percent there.
    const double r2 = std::pow(2.0 * widest / std::min(result.fx_px, result.fy_px), 2);
    if (whole(random, 0, 7) == 0) {  // rarely: checking one takes long
        result.k1 = uniform(random, -0.05, 0.1) / r2;
        result.k2 = uniform(random, -0.01, 0.02) / (r2 * r2);
        result.k3 = uniform(random, -0.005, 0.01) / (r2 * r2 * r2);
        result.p1 = uniform(random, -0.005, 0.005) / std::sqrt(r2);
        result.p2 = uniform(random, -0.005, 0.005) / std::sqrt(r2);
    }
    return result;
}

calibration random_calibration(Random &random) {
    std::string printable, letters = "._-";
    for (char c = ' '; c <= '~'; c++) {
        printable += c;
        if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
            letters += c;
        }
    }
    calibration value{};
    random_text(random, value.id, letters, 1);
    random_text(random, value.note, printable, 0);
    for (char &c : value.note) {
        if (c == ' ' && (&c == value.note || (&c)[1] == '\0')) {
            c = '_';
        }
    }
    if (whole(random, 0, 1) != 0) {
        std::snprintf(value.date, sizeof value.date, "%04d-%02d-%02d", whole(random, 0, 9999),
                      whole(random, 1, 12), whole(random, 1, 28));
    }
    value.left = random_lens(random);
    value.right = random_lens(random);
    for (int i = 0; i < 3; i++) {
        value.rotation_right_left_rad[i] = uniform(random, -1.8, 1.8);
        value.translation_right_left_mm[i] =
            uniform(random, -1, 1) * std::pow(10.0, uniform(random, -2, 4.7));
    }
    if (whole(random, 0, 1) != 0) {
        value.depth_near_mm = std::pow(10.0, uniform(random, -2, 6));
        value.depth_far_mm = value.depth_near_mm * uniform(random, 1.1, 1000) + 0.01;
    }
    value.rms_px = uniform(random, 0, 1000);
    value.rectified = whole(random, 0, 3) == 0;
    if (value.rectified) {
        lens &left = value.left;
        left.k1 = left.k2 = left.p1 = left.p2 = left.k3 = 0;
        value.right = left;
        value.right.cx_px = left.cx_px + uniform(random, -500, 500);
        for (int i = 0; i < 3; i++) {
            value.rotation_right_left_rad[i] = 0;
        }
        double *const t_mm = value.translation_right_left_mm;
        t_mm[0] = -std::abs(t_mm[0]);
        t_mm[1] = t_mm[2] = 0;
    }
    return value;
}

}  // namespace

TEST_CASE("random calibrations survive the text bit by bit") {
    Random random(synthetic::test_seed());
    int printed = 0, tried = 0;
    while (printed < 100000) {
        tried++;
        REQUIRE(tried < 200000);
        const calibration value = random_calibration(random);
        char text[CALIBRATION_TEXT_MAX_BYTES];
        const int length = calibration_print(&value, text, sizeof text);
        if (length < 0) {
            continue;  // e.g. an angle above pi
        }
        printed++;
        calibration rounded = value, parsed;
        const bool good =
            calibration_round(&rounded) == ERROR_OK &&
            calibration_parse(text, static_cast<size_t>(length), &parsed, nullptr) == ERROR_OK &&
            same_bits(rounded, parsed);
        char again[CALIBRATION_TEXT_MAX_BYTES];
        const bool same = good && calibration_print(&parsed, again, sizeof again) == length &&
                          std::memcmp(text, again, static_cast<size_t>(length) + 1) == 0;
        if (!same) {
            INFO("text ", text);
            CHECK(good);
            CHECK(same);
        }
    }
    MESSAGE(printed, " of ", tried, " random calibrations were valid and went round");
}

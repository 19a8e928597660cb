// SPDX-License-Identifier: Apache-2.0
// Evaluation rules and the float-map reader, each against a simple second implementation of the
// rule.
#include "tools/host/evaluate/evaluate.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include "scratch.hpp"
#include "synthetic/seed.hpp"
#include "tools/host/formats/pfm.hpp"

namespace {

const float none = std::numeric_limits<float>::infinity();

std::vector<float> random_map(std::mt19937 *random, std::size_t pixels, double missing) {
    std::uniform_real_distribution<float> value(-40.0F, 60.0F);
    std::bernoulli_distribution is_missing(missing);
    std::vector<float> map(pixels);
    for (float &v : map) {
        v = is_missing(*random) ? none : value(*random);
    }
    return map;
}

/// The filling rule applied pixel by pixel; `evaluate_fill` works gap by gap.
float filled_pixel(const float *row, int width, int x) {
    if (std::isfinite(row[x])) {
        return row[x];
    }
    int left = x, right = x;
    while (left >= 0 && !std::isfinite(row[left])) {
        left--;
    }
    while (right < width && !std::isfinite(row[right])) {
        right++;
    }
    if (left < 0 && right >= width) {
        return 0;
    }
    if (left < 0) {
        return row[right];
    }
    if (right >= width) {
        return row[left];
    }
    return std::fmin(row[left], row[right]);
}

std::vector<unsigned char> bytes_of(const std::string &header, const std::vector<float> &values,
                                    bool big_endian) {
    std::vector<unsigned char> bytes(header.begin(), header.end());
    for (const float value : values) {
        unsigned char raw[4];
        std::memcpy(raw, &value, 4);  // the test machines are little-endian
        for (int i = 0; i < 4; i++) {
            bytes.push_back(raw[big_endian ? 3 - i : i]);
        }
    }
    return bytes;
}

}  // namespace

TEST_CASE("filling takes the farther neighbour, the only one, or 0") {
    std::vector<float> map = {none, 3,    none, none, 7,    none,  // both neighbours, borders
                              none, none, none, none, none, none, 5, none, -2, none, none, 9};
    evaluate_fill(6, 3, map.data());
    const std::vector<float> wanted = {3, 3, 3, 3, 7, 7, 0, 0, 0, 0, 0, 0, 5, -2, -2, -2, -2, 9};
    CHECK(map == wanted);
}

TEST_CASE("filling agrees with the rule applied pixel by pixel") {
    const auto seed = static_cast<unsigned>(synthetic::test_seed());
    INFO("seed ", seed);
    std::mt19937 random(seed);
    for (int round = 0; round < 200; round++) {
        const int width = 1 + static_cast<int>(random() % 40),
                  height = 1 + static_cast<int>(random() % 5);
        const double missing = static_cast<double>(random() % 101) / 100.0;
        const std::vector<float> map =
            random_map(&random, static_cast<std::size_t>(width * height), missing);
        std::vector<float> filled = map;
        evaluate_fill(width, height, filled.data());
        int wrong = 0;
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                wrong += filled[static_cast<std::size_t>(y * width + x)] !=
                                 filled_pixel(&map[static_cast<std::size_t>(y * width)], width, x)
                             ? 1
                             : 0;
            }
        }
        REQUIRE(wrong == 0);
    }
}

TEST_CASE("scores of a map worked out by hand") {
    // errors: 0, 0.5 (not bad-0.5: the limit itself is good), 1.5, rejected (filled 10 -> error 3),
    // unknown truth, occluded with error 8
    const std::vector<float> disparity = {10, 10.5F, 11.5F, none, 10, 20};
    const std::vector<float> truth = {10, 10, 10, 13, none, 12};
    const std::vector<std::uint8_t> mask = {255, 255, 255, 255, 255, 128};
    evaluate_input input;
    input.width_px = 6;
    input.height_px = 1;
    input.disparity_px = disparity.data();
    input.truth_px = truth.data();
    input.mask = mask.data();
    const evaluate_result result = evaluate_disparity(input);
    CHECK(result.filled_all.pixels == 5);
    CHECK(result.filled_visible.pixels == 4);
    CHECK(result.saved_all.pixels == 4);
    CHECK(result.kept_visible.pixels == 3);
    CHECK(result.density_all_percent == doctest::Approx(80.0));
    CHECK(result.density_visible_percent == doctest::Approx(75.0));
    CHECK(result.filled_visible.bad_percent[0] == doctest::Approx(50.0));
    CHECK(result.filled_visible.bad_percent[1] == doctest::Approx(50.0));
    CHECK(result.filled_visible.bad_percent[2] == doctest::Approx(25.0));
    CHECK(result.filled_visible.bad_percent[3] == doctest::Approx(0.0));
    CHECK(result.filled_all.bad_percent[3] == doctest::Approx(20.0));
    CHECK(result.kept_visible.average_px == doctest::Approx(2.0 / 3.0));
    CHECK(result.kept_visible.rms_px == doctest::Approx(std::sqrt(2.5 / 3.0)));
    input.mask = nullptr;
    const evaluate_result no_mask = evaluate_disparity(input);
    CHECK(no_mask.filled_visible.pixels == no_mask.filled_all.pixels);
    CHECK(no_mask.filled_all.average_px == doctest::Approx((0 + 0.5 + 1.5 + 3 + 8) / 5.0));
}

TEST_CASE("rounding goes to the nearest whole pixel, also below zero") {
    const std::vector<float> disparity = {2.4F, 2.6F, -2.4F, -2.6F};
    const std::vector<float> truth = {2, 3, -2, -3};
    evaluate_input input;
    input.width_px = 4;
    input.height_px = 1;
    input.disparity_px = disparity.data();
    input.truth_px = truth.data();
    CHECK(evaluate_disparity(input).filled_all.average_px == doctest::Approx(0.4));
    input.round_disparity = true;
    CHECK(evaluate_disparity(input).filled_all.average_px == 0.0);
}

TEST_CASE("no known pixel gives zeros, not NaN") {
    const std::vector<float> disparity = {1, 2}, truth = {none, none};
    evaluate_input input;
    input.width_px = 2;
    input.height_px = 1;
    input.disparity_px = disparity.data();
    input.truth_px = truth.data();
    const evaluate_result result = evaluate_disparity(input);
    CHECK(result.filled_all.pixels == 0);
    CHECK(result.filled_all.average_px == 0.0);
    CHECK(result.density_all_percent == 0.0);
}

TEST_CASE("a float map is read from its file; a missing one is named") {
    const scratch here;
    const std::vector<unsigned char> bytes =
        bytes_of("Pf\n3 2\n-1.0\n", {1, 2, none, 4, 5, 6}, false);
    const std::string path = here.write("map.pfm", std::string(bytes.begin(), bytes.end()));
    std::string message;
    pfm_image image;
    REQUIRE_MESSAGE(pfm_read(path, &image, &message), message);
    CHECK(image.width_px == 3);
    CHECK(image.height_px == 2);
    const std::vector<float> wanted = {4, 5, 6, 1, 2, none};
    CHECK(image.values == wanted);
    CHECK_FALSE(pfm_read(here / "none.pfm", &image, &message));
    CHECK(message.find(here / "none.pfm") == 0);
    CHECK(image.values == wanted);
}

TEST_CASE("both byte orders are read, rows from the bottom") {
    pfm_image image;
    std::string message;
    for (const bool big_endian : {false, true}) {
        const std::vector<unsigned char> bytes =
            bytes_of(big_endian ? "Pf\n2 2\n1.0\n" : "Pf\n2 2\n-1.0\n", {1, 2, 3, 4}, big_endian);
        REQUIRE_MESSAGE(pfm_parse(bytes.data(), bytes.size(), &image, &message), message);
        CHECK(image.values == std::vector<float>{3, 4, 1, 2});
    }
}

TEST_CASE("bad float maps are rejected with a reason") {
    const struct {
        const char *header;
        const char *expected;
    } table[] = {
        {"", "Pf"},
        {"P5\n2 2\n255\n", "Pf"},
        {"PF\n2 2\n-1.0\n", "colour"},
        {"Pf\n0 2\n-1.0\n", "width"},
        {"Pf\n-2 2\n-1.0\n", "width"},
        {"Pf\n99999 99999\n-1.0\n", "width"},
        {"Pf\n123456789012345678901234567890123456789 2\n-1.0\n", "width"},
        {"Pf\n2 2\n0\n", "scale"},
        {"Pf\n2 2\nnan\n", "scale"},
        {"Pf\n2 2\nlittle\n", "scale"},
        {"Pf\n2 3\n-1.0\n", "truncated"},
        {"Pf\n16384 16384\n-1.0\n", "truncated"},
    };
    for (const auto &bad : table) {
        CAPTURE(bad.header);
        const std::vector<unsigned char> bytes = bytes_of(bad.header, {1, 2, 3, 4}, false);
        pfm_image image;
        std::string message;
        CHECK_FALSE(pfm_parse(bytes.data(), bytes.size(), &image, &message));
        CHECK(message.find(bad.expected) != std::string::npos);
        CHECK(image.values.empty());
    }
}

// SPDX-License-Identifier: Apache-2.0
// What is filled, with what, and what stays empty.
#include "stereo/fill.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <new>
#include <random>
#include <vector>

#include "core/error.h"
#include "stereo/image/reason.h"
#include "synthetic/seed.hpp"
#include "synthetic/threads.hpp"

namespace {

using rgb = std::array<uint8_t, 3>;
constexpr rgb grey = {120, 120, 120};

struct Map {
    int width, height;
    std::vector<int32_t> disparity_q8;
    std::vector<uint8_t> reason, colour;
    std::vector<uint8_t> sigma;
    std::vector<rectify_span> span;

    Map(int columns, int rows, const std::function<double(int x, int y)> &disparity_px)
        : width(columns), height(rows), span(static_cast<size_t>(rows)) {
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                disparity_q8.push_back(static_cast<int32_t>(std::lround(256 * disparity_px(x, y))));
                reason.push_back(REASON_VALID);
                sigma.push_back(20);
                colour.insert(colour.end(), grey.begin(), grey.end());
            }
            span[static_cast<size_t>(y)] = {0, static_cast<int16_t>(width)};
        }
    }

    size_t at(int x, int y) const { return static_cast<size_t>(y * width + x); }

    void reject(int left, int top, int right, int bottom, uint8_t why = REASON_NO_TEXTURE) {
        for (int y = top; y < bottom; y++) {
            for (int x = left; x < right; x++) {
                reason[at(x, y)] = why;
                disparity_q8[at(x, y)] = 77777;
                sigma[at(x, y)] = 0;
            }
        }
    }

    void paint(int left, int top, int right, int bottom, rgb value) {
        for (int y = top; y < bottom; y++) {
            for (int x = left; x < right; x++) {
                std::copy(value.begin(), value.end(), colour.begin() + 3 * (y * width + x));
            }
        }
    }

    int fill(const parallel *parallel = &parallel_serial) {
        const image_rgb8 image = {colour.data(), width, height, 3 * width};
        image_u8 view = {sigma.data(), width, height, width};
        match_output output{};
        output.disparity_q8 = {disparity_q8.data(), width, height, width};
        output.reason = {reason.data(), width, height, width};
        const size_t bytes = fill_need_bytes(width, height);
        void *memory = ::operator new (bytes, std::align_val_t{ARENA_ALIGNMENT});
        arena arena;
        arena_init(&arena, memory, bytes);
        const fill_input input = {&image, span.data(), &view};
        const int error = fill_run(&input, parallel, &arena, &output);
        CHECK(arena.used_bytes == 0);
        ::operator delete (memory, std::align_val_t{ARENA_ALIGNMENT});
        return error;
    }
};

double plane_px(double slope_x, double slope_y, int x, int y) {
    return 20 + slope_x * x + slope_y * y;
}

// Filled pixels in a box whose disparity is off by more than `limit_px`; pixels that are not filled
// count too.
int wrong(const Map &map, const std::array<int, 4> &box, double limit_px,
          const std::function<double(int x, int y)> &disparity_px) {
    int count = 0;
    for (int y = box[1]; y < box[3]; y++) {
        for (int x = box[0]; x < box[2]; x++) {
            const double off_px = map.disparity_q8[map.at(x, y)] / 256.0 - disparity_px(x, y);
            count += map.reason[map.at(x, y)] != REASON_FILLED || std::fabs(off_px) > limit_px;
        }
    }
    return count;
}

}  // namespace

TEST_CASE("a hole in a tilted plane is filled exactly") {
    std::mt19937 random(static_cast<uint32_t>(synthetic::test_seed()));
    std::uniform_real_distribution<double> slope(-1, 1);
    for (int round = 0; round < 20; round++) {
        const double slope_x = 1.5 * slope(random);
        const double slope_y = 2 * slope(random);
        CAPTURE(slope_x);
        CAPTURE(slope_y);
        const auto disparity_px = [&](int x, int y) { return plane_px(slope_x, slope_y, x, y); };
        Map map(120, 100, disparity_px);
        const int width = 1 + static_cast<int>(random() % 50);
        const int height = 1 + static_cast<int>(random() % 50);
        const std::array<int, 4> hole = {30, 25, 30 + width, 25 + height};
        map.reject(hole[0], hole[1], hole[2], hole[3]);
        const Map before = map;
        REQUIRE(map.fill() == ERROR_OK);
        CHECK(wrong(map, hole, 1.5 / 256, disparity_px) == 0);
        int changed = 0;
        for (size_t i = 0; i < map.reason.size(); i++) {
            changed +=
                before.reason[i] == REASON_VALID &&
                (map.reason[i] != REASON_VALID || map.disparity_q8[i] != before.disparity_q8[i] ||
                 map.sigma[i] != before.sigma[i]);
            changed += map.reason[i] == REASON_FILLED && map.sigma[i] != 0;
        }
        CHECK(changed == 0);
    }
}

TEST_CASE("a hole beside a nearer object continues the farther surface") {
    const auto wall_px = [](int x, int y) { return plane_px(0.02, -0.03, x, y); };
    const auto disparity_px = [&](int x, int y) { return x < 60 ? wall_px(x, y) : 60.0; };
    const std::array<int, 4> hole = {40, 0, 60, 100};
    for (const rgb object : {grey, rgb{200, 40, 40}}) {
        Map map(120, 100, disparity_px);
        map.paint(60, 0, 120, 100, object);
        map.reject(hole[0], hole[1], hole[2], hole[3], REASON_OCCLUDED);
        REQUIRE(map.fill() == ERROR_OK);
        CHECK(wrong(map, hole, 1, wall_px) == 0);  // its slope is held
    }
}

TEST_CASE("a hole within a nearer object, or of its colour alone, continues the object") {
    const auto disparity_px = [](int x, int y) {
        return x >= 30 && x < 90 && y >= 20 && y < 80 ? 60.0 : 20.0;
    };
    const auto object_px = [](int, int) { return 60.0; };
    SUBCASE("within") {
        Map map(120, 100, disparity_px);
        const std::array<int, 4> hole = {40, 30, 80, 70};
        map.reject(hole[0], hole[1], hole[2], hole[3]);
        REQUIRE(map.fill() == ERROR_OK);
        CHECK(wrong(map, hole, 0.1, object_px) == 0);
    }
    SUBCASE("its colour") {
        Map map(120, 100, disparity_px);
        map.paint(30, 20, 90, 80, {230, 230, 220});
        const std::array<int, 4> rim = {30, 20, 45, 80};
        map.reject(rim[0], rim[1], rim[2], rim[3]);
        REQUIRE(map.fill() == ERROR_OK);
        CHECK(wrong(map, rim, 0.1, object_px) == 0);
    }
}

TEST_CASE("nothing is filled far from valid matches, at the border, or outside of the image") {
    constexpr int width = 2 * FILL_REACH_PX + 100;
    Map map(width, width, [](int, int) { return 10.0; });
    map.reject(20, 20, width - 20, width - 20);
    map.reject(0, 0, 10, width, REASON_BORDER);
    map.reject(12, 5, 14, 7);
    map.span[6] = {13, static_cast<int16_t>(width)};
    REQUIRE(map.fill() == ERROR_OK);
    CHECK(map.reason[map.at(width / 2, width / 2)] == REASON_NO_TEXTURE);
    CHECK(map.disparity_q8[map.at(width / 2, width / 2)] == 77777);
    CHECK(map.reason[map.at(25, width / 2)] == REASON_FILLED);
    CHECK(map.reason[map.at(5, 50)] == REASON_BORDER);
    CHECK(map.reason[map.at(12, 5)] == REASON_FILLED);
    CHECK(map.reason[map.at(12, 6)] == REASON_NO_TEXTURE);
    CHECK(map.reason[map.at(13, 6)] == REASON_FILLED);

    Map empty(40, 30, [](int, int) { return 10.0; });
    empty.reject(0, 0, 40, 30, REASON_AMBIGUOUS);
    REQUIRE(empty.fill() == ERROR_OK);
    CHECK(empty.reason == std::vector<uint8_t>(40 * 30, REASON_AMBIGUOUS));
}

TEST_CASE("an island that fits no surface around is ignored") {
    Map map(120, 100, [](int, int) { return 10.0; });
    const std::array<int, 4> hole = {40, 30, 80, 70};
    map.reject(hole[0], hole[1], hole[2], hole[3]);
    map.reason[map.at(60, 50)] = REASON_VALID;
    map.disparity_q8[map.at(60, 50)] = 256 * 3;
    REQUIRE(map.fill() == ERROR_OK);
    CHECK(wrong(map, {40, 30, 60, 70}, 0.01, [](int, int) { return 10.0; }) == 0);
    CHECK(map.disparity_q8[map.at(60, 50)] == 256 * 3);
}

TEST_CASE("the result does not depend on the number of threads") {
    std::mt19937 random(static_cast<uint32_t>(synthetic::test_seed()));
    Map map(150, 90, [&](int x, int y) {
        return (x / 40 * 5) + 0.1 * y + 0.001 * static_cast<double>(random() % 300);
    });
    for (int i = 0; i < 12; i++) {
        const int left = static_cast<int>(random() % 120);
        const int top = static_cast<int>(random() % 70);
        map.reject(left, top, left + 1 + static_cast<int>(random() % 30),
                   top + 1 + static_cast<int>(random() % 20));
        map.paint(left, 0, left + 20, 90, {static_cast<uint8_t>(random()), 90, 90});
    }
    Map serial = map;
    REQUIRE(serial.fill() == ERROR_OK);
    for (const int threads : {2, 5}) {
        Map other = map;
        const synthetic::Threads pool(threads, random());
        REQUIRE(other.fill(pool.parallel()) == ERROR_OK);
        CHECK(other.disparity_q8 == serial.disparity_q8);
        CHECK(other.reason == serial.reason);
        CHECK(other.sigma == serial.sigma);
    }
}

TEST_CASE("without memory nothing changes") {
    Map map(40, 30, [](int, int) { return 10.0; });
    map.reject(5, 5, 9, 9);
    const image_rgb8 image = {map.colour.data(), map.width, map.height, 3 * map.width};
    image_u8 sigma = {map.sigma.data(), map.width, map.height, map.width};
    match_output output{};
    output.disparity_q8 = {map.disparity_q8.data(), map.width, map.height, map.width};
    output.reason = {map.reason.data(), map.width, map.height, map.width};
    arena arena;
    arena_init(&arena, nullptr, 0);
    const fill_input input = {&image, nullptr, &sigma};
    CHECK(fill_run(&input, &parallel_serial, &arena, &output) == ERROR_MEMORY);
    CHECK(map.reason[map.at(6, 6)] == REASON_NO_TEXTURE);
}

// SPDX-License-Identifier: Apache-2.0
// Small islands compared with a plain flood fill, with any number of threads.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <utility>
#include <vector>

#include "core/error.h"
#include "stereo/image/reason.h"
#include "stereo/match/checks.h"
#include "stereo/match/tuning.h"
#include "synthetic/matched.hpp"
#include "synthetic/seed.hpp"
#include "synthetic/threads.hpp"

namespace {

class Random {
  public:
    explicit Random(uint64_t seed) : bits_(static_cast<uint32_t>(seed)) {}
    int between(int low, int high) {
        return low + static_cast<int>(bits_() % static_cast<uint32_t>(high - low + 1));
    }
    bool one_in(int count) { return between(1, count) == 1; }

  private:
    std::mt19937 bits_;
};

struct Map {
    int width, height;
    std::vector<int32_t> disparity_q8;
    std::vector<uint8_t> reason;

    match_output output() {
        match_output result{};
        result.disparity_q8 = {disparity_q8.data(), width, height, width};
        result.reason = {reason.data(), width, height, width};
        result.confidence = {nullptr, width, height, width};
        return result;
    }
};

// Patches of disparities and holes. `patch` is about the maximum size of an island.
Map random_map(Random &random, int width, int height, int patch) {
    Map map{width, height, {}, {}};
    const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    map.disparity_q8.assign(pixels, 0);
    map.reason.assign(pixels, REASON_VALID);
    const int patches = 1 + width * height / (patch * patch);
    for (int i = 0; i < 2 * patches; i++) {
        const int left = random.between(-patch, width);
        const int top = random.between(-patch, height);
        const int right = left + random.between(1, 2 * patch);
        const int bottom = top + random.between(1, 2 * patch);
        const int disparity_q8 = random.between(-3, 3) * 200;
        const uint8_t reason = random.one_in(3) ? REASON_OCCLUDED : REASON_VALID;
        for (int y = std::max(top, 0); y < std::min(bottom, height); y++) {
            for (int x = std::max(left, 0); x < std::min(right, width); x++) {
                const auto at = static_cast<size_t>(y * width + x);
                map.disparity_q8[at] = disparity_q8 + random.between(0, 60);
                map.reason[at] = reason;
            }
        }
    }
    return map;
}

std::vector<uint8_t> flooded(const Map &map, int limit) {
    std::vector<uint8_t> reason = map.reason;
    std::vector<bool> seen(reason.size(), false);
    for (size_t start = 0; start < reason.size(); start++) {
        if (map.reason[start] != REASON_VALID || seen[start]) {
            continue;
        }
        std::vector<size_t> island{start};
        seen[start] = true;
        for (size_t i = 0; i < island.size(); i++) {
            const int x = static_cast<int>(island[i]) % map.width;
            const int y = static_cast<int>(island[i]) / map.width;
            for (const auto &[dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
                if (x + dx < 0 || x + dx >= map.width || y + dy < 0 || y + dy >= map.height) {
                    continue;
                }
                const auto next = static_cast<size_t>((y + dy) * map.width + x + dx);
                if (!seen[next] && map.reason[next] == REASON_VALID &&
                    std::abs(map.disparity_q8[next] - map.disparity_q8[island[i]]) <=
                        TUNE_ISLAND_STEP) {
                    seen[next] = true;
                    island.push_back(next);
                }
            }
        }
        if (island.size() < static_cast<size_t>(limit)) {
            for (const size_t pixel : island) {
                reason[pixel] = REASON_SPECKLE;
            }
        }
    }
    return reason;
}

}  // namespace

TEST_CASE("islands have the size of a flood fill, for any distribution of rows") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    for (int round = 0; round < 400; round++) {
        const int width = random.between(1, 90);
        const int height = random.between(1, 70);
        const int limit = random.between(0, 80);
        Map map = random_map(random, width, height, random.between(1, 12));
        const std::vector<uint8_t> expected = flooded(map, limit);
        const int threads = random.between(1, 10);
        CAPTURE(round);
        CAPTURE(width);
        CAPTURE(height);
        CAPTURE(limit);
        CAPTURE(threads);
        const synthetic::Threads pool(threads, static_cast<uint64_t>(round));
        const synthetic::Memory memory(speckle_filter_need_bytes(width, limit, threads));
        arena arena;
        arena_init(&arena, memory.data(), memory.size());
        match_output output = map.output();
        REQUIRE(speckle_filter_run_all(limit, pool.parallel(), &arena, &output) == ERROR_OK);
        REQUIRE(map.reason == expected);
    }
}

TEST_CASE("without enough memory nothing is changed") {
    Random random(1);
    Map map = random_map(random, 40, 30, 5);
    const std::vector<uint8_t> before = map.reason;
    const synthetic::Threads pool(2);
    const synthetic::Memory memory(speckle_filter_need_bytes(40, 60, 2) / 2);
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    match_output output = map.output();
    CHECK(speckle_filter_run_all(60, pool.parallel(), &arena, &output) == ERROR_MEMORY);
    CHECK(map.reason == before);
}

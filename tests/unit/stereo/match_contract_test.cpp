// SPDX-License-Identifier: Apache-2.0
// The rest of the matcher's contract: sizes, strides, ranges, spans, memory, threads, progress,
// errors, and identical results for identical pairs.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "core/error.h"
#include "stereo/match/match.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"
#include "synthetic/threads.hpp"

using namespace synthetic;

namespace {

Pair small_pair(int width, int height, uint64_t seed) {
    const Rig rig = rectified_rig(width, height, 400, 50);
    RenderOptions options;
    options.samples = 1;
    options.seed = seed;
    options.left.noise_grey = options.right.noise_grey = 1;
    return render(step(rig, 9, 5, {3, 0.15}, seed), rig, options);
}

bool same_answer(const Matched &a, const Matched &b) {
    return a.status == b.status && a.disparity_q8 == b.disparity_q8 && a.reason == b.reason &&
           a.confidence == b.confidence;
}

std::vector<uint8_t> random_image(int width, int height, Random &random) {
    std::vector<uint8_t> image(static_cast<size_t>(width) * static_cast<size_t>(height));
    for (uint8_t &value : image) {
        value = static_cast<uint8_t>(random.bits());
    }
    return image;
}

// Properties of every result, for any images.
void check_sane(const Matched &matched, const match_options &options) {
    int wrong = 0;
    for (size_t i = 0; i < matched.reason.size(); i++) {
        const bool known_reason = matched.reason[i] < REASON_COUNT;
        const double disparity = matched.disparity_px(i);
        const bool in_range = disparity > options.disparity_min - 1 &&
                              disparity < options.disparity_min + options.disparity_count;
        const double x = static_cast<double>(i % static_cast<size_t>(matched.width));
        const bool in_image = x - disparity > -1 && x - disparity < matched.width;
        wrong += !known_reason || !in_range || (matched.valid(i) && !in_image);
    }
    CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("the answer is the same for any number of threads and any order of the parts") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Pair pair = small_pair(160, 120, seed);
    const match_options options = match_default_options(-3, 40);
    const Matched serial = run_match(pair, options);
    REQUIRE(serial.status == ERROR_OK);
    for (int threads = 1; threads <= 8; threads++) {
        CAPTURE(threads);
        const Threads pool(threads, seed);
        MatchSetting setting;
        setting.parallel = pool.parallel();
        const Matched matched = run_match(pair, options, setting);
        CHECK(pool.calls() > 0);
        CHECK(same_answer(matched, serial));
        CHECK(matched.peak_bytes <= matched.need_bytes);
    }
}

TEST_CASE("neither strides nor what lies between the rows matter") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Pair pair = small_pair(61, 40, seed);
    match_options options = match_default_options(0, 24);
    for (const match_preset preset : {MATCH_PRESET_STANDARD, MATCH_PRESET_PAPER}) {
        options.preset = preset;
        const Matched dense = run_match(pair, options);
        REQUIRE(dense.status == ERROR_OK);
        for (const int extra : {1, 3, 64, 1000}) {
            MatchSetting setting;
            setting.stride_extra = extra;
            CHECK(same_answer(run_match(pair, options, setting), dense));
        }
    }
}

TEST_CASE("shifting the right image shifts the disparities and nothing else") {
    // Exact where neither result is influenced by the image border, and nothing is searched at half
    // the size, where an odd shift is half a pixel (the search excludes both). The image's middle
    // is far from the borders, and path costs fade on the way.
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const int width = 220;
    const int height = 60;
    const Pair pair = small_pair(width, height, seed);
    const std::vector<uint8_t> left = as_u8(pair.left, width, height, 8, width);
    const std::vector<uint8_t> right = as_u8(pair.right, width, height, 8, width);
    const Matched still = run_match(left, right, width, height, match_default_options(0, 16));
    REQUIRE(still.status == ERROR_OK);
    for (const int shift : {-37, -8, 1, 20}) {
        CAPTURE(shift);
        // Content moves left by `shift`, so disparities grow by it; the new part is mirrored.
        std::vector<uint8_t> moved(right.size());
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                int from = x + shift;
                from = from < 0 ? -from : (from >= width ? 2 * width - 2 - from : from);
                moved[still.index(x, y)] = right[still.index(from, y)];
            }
        }
        const Matched matched =
            run_match(left, moved, width, height, match_default_options(shift, 16));
        REQUIRE(matched.status == ERROR_OK);
        int differing = 0, compared = 0;
        for (int y = 0; y < height; y++) {
            for (int x = 90; x < 150; x++, compared++) {
                const size_t i = still.index(x, y);
                differing += matched.disparity_q8[i] != still.disparity_q8[i] + 256 * shift ||
                             matched.reason[i] != still.reason[i] ||
                             matched.confidence[i] != still.confidence[i];
            }
        }
        CAPTURE(compared);
        CHECK(differing == 0);
    }
}

TEST_CASE("memory is what was promised, and does not depend on the height of a high image") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    const match_options options = match_default_options(0, 48);
    size_t higher = 0;
    for (const int height : {900, 300, 64, 16}) {
        const Matched matched = run_match(random_image(120, height, random),
                                          random_image(120, height, random), 120, height, options);
        CHECK(matched.status == ERROR_OK);
        CHECK(matched.peak_bytes <= matched.need_bytes);
        CHECK(matched.peak_bytes > matched.need_bytes / 2);
        CHECK((height == 900 || matched.peak_bytes <= higher));
        CHECK((height != 300 || matched.peak_bytes == higher));
        higher = matched.peak_bytes;
    }
    // O(width x disparities): twice the width or twice the disparities need at most a little more
    // than twice the memory, and not more than a full cost volume of 40 rows.
    const auto need = [](int width, int count) {
        const match_options asked = match_default_options(0, count);
        return static_cast<double>(match_needs(width, IMAGE_MAX_SIDE_PX, &asked, 1).bytes);
    };
    CHECK(need(1280, 128) < 2.05 * need(640, 128));
    CHECK(need(640, 256) < 2.05 * need(640, 128));
    CHECK(need(1280, 128) < 80.0 * 1280 * 128);
}

TEST_CASE("with less memory than it asked for the matcher refuses") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Pair pair = small_pair(48, 24, seed);
    const match_options options = match_default_options(0, 16);
    const size_t need = match_needs(48, 24, &options, 1).bytes;
    const size_t peak = run_match(pair, options).peak_bytes;
    int refused = 0;
    for (size_t size = 64; size < peak; size += peak / 37) {
        MatchSetting setting;
        setting.memory_bytes = size;
        refused += run_match(pair, options, setting).status == ERROR_MEMORY;
    }
    CHECK(refused >= 36);
    MatchSetting setting;
    setting.memory_bytes = need;
    CHECK(run_match(pair, options, setting).status == ERROR_OK);
}

TEST_CASE("any size, count and range gives an answer that makes sense") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    struct Shape {
        int width, height, disparity_min, disparity_count;
    };
    const Shape shapes[] = {
        {MATCH_MIN_WIDTH_PX, MATCH_MIN_HEIGHT_PX, 0, 1},
        {MATCH_MIN_WIDTH_PX, MATCH_MIN_HEIGHT_PX, 0, 16},
        {MATCH_MIN_WIDTH_PX, MATCH_MIN_HEIGHT_PX, -5, 9},
        {17, 9, 3, 2},
        {33, 11, 0, 33},
        {40, 20, 0, 1},
        {40, 20, 7, 1},
        {31, 13, -31, 62},
        {64, 16, 0, MATCH_MAX_DISPARITIES},
        {64, 16, -MATCH_DISPARITY_LIMIT, MATCH_MAX_DISPARITIES},
        {50, 10, -MATCH_DISPARITY_LIMIT, 1},
        {50, 10, MATCH_DISPARITY_LIMIT - 1, 1},
        {1500, 8, 0, MATCH_MAX_DISPARITIES},
        {IMAGE_MAX_SIDE_PX, 8, 4, 20},
        {100, 50, -20, 31},
        {100, 50, 95, 20},
    };
    for (const Shape &shape : shapes) {
        CAPTURE(shape.width);
        CAPTURE(shape.height);
        CAPTURE(shape.disparity_min);
        CAPTURE(shape.disparity_count);
        const match_options options =
            match_default_options(shape.disparity_min, shape.disparity_count);
        const Matched matched = run_match(random_image(shape.width, shape.height, random),
                                          random_image(shape.width, shape.height, random),
                                          shape.width, shape.height, options);
        CHECK(matched.status == ERROR_OK);
        CHECK(matched.peak_bytes <= matched.need_bytes);
        check_sane(matched, options);
    }
}

TEST_CASE("random shapes and extreme pixels") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    for (int round = 0; round < 40; round++) {
        const int width = static_cast<int>(random.uniform(MATCH_MIN_WIDTH_PX, 130));
        const int height = static_cast<int>(random.uniform(MATCH_MIN_HEIGHT_PX, 40));
        const int count = static_cast<int>(random.uniform(1, 90));
        const int first = static_cast<int>(random.uniform(-60, 60));
        CAPTURE(round);
        CAPTURE(width);
        CAPTURE(height);
        CAPTURE(count);
        CAPTURE(first);
        std::vector<uint8_t> left = random_image(width, height, random);
        std::vector<uint8_t> right = random_image(width, height, random);
        if (round % 2 == 0) {
            for (auto *image : {&left, &right}) {
                for (uint8_t &value : *image) {
                    value = value < 128 ? 0 : 255;
                }
            }
        }
        match_options options = match_default_options(first, count);
        options.preset = round % 4 == 3 ? MATCH_PRESET_PAPER : MATCH_PRESET_STANDARD;
        MatchSetting setting;
        const Threads pool(1 + round % 3, seed);
        setting.parallel = pool.parallel();
        const Matched matched = run_match(left, right, width, height, options, setting);
        CHECK(matched.status == ERROR_OK);
        check_sane(matched, options);
    }
}

TEST_CASE("pixels outside the spans are borders and influence nothing") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Pair pair = small_pair(120, 40, seed);
    const match_options options = match_default_options(0, 16);
    std::vector<rectify_span> left_span(40), right_span(40);
    for (int y = 0; y < 40; y++) {
        const auto slant = static_cast<int16_t>(y / 4);
        left_span[static_cast<size_t>(y)] = {static_cast<int16_t>(5 + slant), 110};
        right_span[static_cast<size_t>(y)] = {3, static_cast<int16_t>(118 - slant)};
    }
    left_span[7] = right_span[9] = {0, 0};  // rows that a camera does not see at all
    const auto run = [&](uint8_t beyond) {
        Matched m = run_match(pair, options);  // run only to get the buffers
        for (int y = 0; y < 40; y++) {
            for (int x = 0; x < 120; x++) {
                const rectify_span left = left_span[static_cast<size_t>(y)];
                const rectify_span right = right_span[static_cast<size_t>(y)];
                m.left[m.index(x, y)] =
                    x >= left.begin && x < left.end ? m.left[m.index(x, y)] : beyond;
                m.right[m.index(x, y)] =
                    x >= right.begin && x < right.end ? m.right[m.index(x, y)] : beyond;
            }
        }
        m.input.left_span = left_span.data();
        m.input.right_span = right_span.data();
        const Memory memory(m.need_bytes);
        arena arena;
        arena_init(&arena, memory.data(), memory.size());
        m.status =
            match_run(&m.input, &options, &parallel_serial, nullptr, nullptr, &arena, &m.output);
        return m;
    };
    const Matched matched = run(0);
    REQUIRE(matched.status == ERROR_OK);
    int wrong = 0, valid = 0;
    for (int y = 0; y < 40; y++) {
        const rectify_span left = left_span[static_cast<size_t>(y)];
        const rectify_span right = right_span[static_cast<size_t>(y)];
        for (int x = 0; x < 120; x++) {
            const size_t i = matched.index(x, y);
            const bool outside = x < left.begin || x >= left.end;
            wrong += outside && matched.reason[i] != REASON_BORDER;
            const double x_right = x - matched.disparity_px(i);
            wrong += matched.valid(i) && (x_right < right.begin - 1 || x_right > right.end);
            valid += matched.valid(i);
        }
    }
    CHECK(wrong == 0);
    CHECK(valid > 2000);
}

TEST_CASE("progress counts up to all rows, and false stops the work") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Pair pair = small_pair(80, 64, seed);
    const match_options options = match_default_options(0, 16);
    std::vector<int> seen;
    MatchSetting setting;
    setting.progress = [&](int rows_done, int rows) {
        CHECK(rows == 64);
        seen.push_back(rows_done);
        return true;
    };
    const Matched whole = run_match(pair, options, setting);
    CHECK(whole.status == ERROR_OK);
    REQUIRE(seen.size() >= 2);
    CHECK(std::is_sorted(seen.begin(), seen.end()));
    CHECK(std::adjacent_find(seen.begin(), seen.end()) == seen.end());
    CHECK(seen.back() == 64);

    const int stop_at = seen[seen.size() / 2];
    int calls = 0;
    setting.progress = [&](int rows_done, int) {
        calls++;
        return rows_done < stop_at;
    };
    const Matched stopped = run_match(pair, options, setting);
    CHECK(stopped.status == ERROR_CANCELLED);
    CHECK(calls == static_cast<int>(seen.size() / 2) + 1);
    int differing = 0;
    // The last row done was not smoothed with the next one.
    for (int y = 0; y < stop_at - 1; y++) {
        for (int x = 0; x < 80; x++) {
            const size_t i = whole.index(x, y);
            differing += stopped.disparity_q8[i] != whole.disparity_q8[i];
        }
    }
    CHECK(differing == 0);
    CHECK(stopped.disparity_q8.back() == INT32_MIN);  // unchanged by the stopped run
}

TEST_CASE("what is out of range is refused with its code, and nothing is written") {
    const uint64_t seed = test_seed();
    Random random(seed);
    const auto status_of = [&](int width, int height, int first, int count) {
        const match_options options = match_default_options(first, count);
        MatchSetting setting;
        setting.memory_bytes = 1 << 20;
        const Matched matched =
            run_match(random_image(width, height, random), random_image(width, height, random),
                      width, height, options, setting);
        CHECK(std::all_of(matched.reason.begin(), matched.reason.end(),
                          [](uint8_t reason) { return reason == 255; }));
        return matched.status;
    };
    CHECK(status_of(MATCH_MIN_WIDTH_PX - 1, 20, 0, 8) == ERROR_TOO_SMALL);
    CHECK(status_of(20, MATCH_MIN_HEIGHT_PX - 1, 0, 8) == ERROR_TOO_SMALL);
    CHECK(status_of(1, 1, 0, 8) == ERROR_TOO_SMALL);
    CHECK(status_of(IMAGE_MAX_SIDE_PX + 1, 8, 0, 8) == ERROR_TOO_LARGE);
    CHECK(status_of(16, IMAGE_MAX_SIDE_PX + 1, 0, 8) == ERROR_TOO_LARGE);
    CHECK(status_of(40, 20, 0, 0) == ERROR_DISPARITY_RANGE);
    CHECK(status_of(40, 20, 0, -1) == ERROR_DISPARITY_RANGE);
    CHECK(status_of(40, 20, 0, MATCH_MAX_DISPARITIES + 1) == ERROR_DISPARITY_RANGE);
    CHECK(status_of(40, 20, 1, MATCH_MAX_DISPARITIES) == ERROR_DISPARITY_RANGE);
    CHECK(status_of(40, 20, -MATCH_DISPARITY_LIMIT - 1, 8) == ERROR_DISPARITY_RANGE);
    CHECK(status_of(40, 20, INT32_MAX, 8) == ERROR_DISPARITY_RANGE);
    CHECK(status_of(40, 20, INT32_MIN, 8) == ERROR_DISPARITY_RANGE);

    const match_options none = match_default_options(0, 0);
    const match_options some = match_default_options(0, 8);
    CHECK(match_needs(40, 20, &none, 1).bytes == 0);
    CHECK(match_needs(0, 20, &some, 1).bytes == 0);
    constexpr int limit = MATCH_DISPARITY_LIMIT;
    for (const int first :
         {limit, -limit - 1, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
        const match_options far = match_default_options(first, 16);
        CHECK(match_needs(40, 20, &far, 1).bytes == 0);
    }
    CHECK(match_needs(IMAGE_MAX_SIDE_PX + 1, 20, &some, 1).bytes == 0);
    CHECK(match_needs(40, IMAGE_MAX_SIDE_PX + 1, &some, 1).bytes == 0);
}

TEST_CASE("images and outputs of differing sizes are refused") {
    const Pair pair = small_pair(40, 24, 1);
    const match_options options = match_default_options(0, 8);
    Matched m = run_match(pair, options);
    const auto status = [&] {
        const Memory memory(m.need_bytes);
        arena arena;
        arena_init(&arena, memory.data(), memory.size());
        return match_run(&m.input, &options, &parallel_serial, nullptr, nullptr, &arena, &m.output);
    };
    REQUIRE(status() == ERROR_OK);
    std::vector<uint8_t> colour(3 * m.left.size());
    m.input.left_colour = {colour.data(), m.width, m.height, 3 * m.width};
    REQUIRE(status() == ERROR_OK);
    m.input.right_colour = m.input.left_colour;
    REQUIRE(status() == ERROR_OK);
    for (int *size :
         {&m.input.right.width, &m.input.right.height, &m.output.reason.width,
          &m.output.disparity_q8.height, &m.output.confidence.width, &m.input.left_colour.width,
          &m.input.left_colour.height, &m.input.right_colour.width, &m.input.right_colour.height}) {
        (*size)--;
        CHECK(status() == ERROR_SIZE_MISMATCH);
        (*size)++;
    }
}

TEST_CASE("speckles below the limit are removed, larger islands stay") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(160, 100, 400, 50);
    Builder builder(rig, seed);
    Scene scene = wall(rig, 6, 0, 0, {3, 0.15}, seed);
    scene.surfaces.push_back(builder.piece(14, 80, 40, 14, 14, builder.noise(14, 3, 0.15)));
    const Pair pair = render(scene, rig, {});
    const auto island = [&](int speckle_px) {
        match_options options = match_default_options(0, 24);
        options.speckle_px = speckle_px;
        const Matched matched = run_match(pair, options);
        REQUIRE(matched.status == ERROR_OK);
        int valid = 0;
        for (int y = 42; y < 52; y++) {
            for (int x = 82; x < 92; x++) {
                valid += matched.valid(matched.index(x, y));
            }
        }
        return valid;
    };
    CHECK(island(0) > 80);
    CHECK(island(60) > 80);
    CHECK(island(400) < 5);
}

TEST_CASE("work counts the pixels times disparities of all levels") {
    match_options options = match_default_options(-5, 256);
    const auto work = [&](match_preset preset) {
        options.preset = preset;
        return match_work(320, 200, &options);
    };
    CHECK(work(MATCH_PRESET_BEST) == doctest::Approx(320 * 200 * 268).epsilon(0.02));
    CHECK(work(MATCH_PRESET_STANDARD) < work(MATCH_PRESET_BEST) / 4);
    CHECK(work(MATCH_PRESET_FAST) < work(MATCH_PRESET_STANDARD));
    CHECK(work(MATCH_PRESET_BOARD) < work(MATCH_PRESET_BEST) / 4);
    CHECK(work(MATCH_PRESET_FAST) >= 320 * 100 * 48);
    CHECK(work(MATCH_PRESET_PAPER) > 0);
    CHECK(match_work(0, 200, &options) == 0);
    CHECK(match_work(320, 0, &options) == 0);
    CHECK(match_work(320, IMAGE_MAX_SIDE_PX + 1, &options) == 0);
    options.disparity_count = 0;
    CHECK(match_work(320, 200, &options) == 0);
}

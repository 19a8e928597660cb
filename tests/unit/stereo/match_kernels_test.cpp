// SPDX-License-Identifier: Apache-2.0
// Every processor level gives the results of plain C: on noise (which takes every branch), on
// smooth images and on related pairs, for all counts of disparities, with every preset and any
// number of threads. The single operations of the levels are compared in tests/portable.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "core/arena.h"
#include "core/error.h"
#include "stereo/match/kernels.h"
#include "stereo/match/match.h"
#include "synthetic/matched.hpp"
#include "synthetic/seed.hpp"
#include "synthetic/threads.hpp"

namespace {

const char *const level_names[] = {"sse41", "avx2", "neon"};

struct Planes {
    std::vector<int32_t> disparity_q8;
    std::vector<uint8_t> reason, confidence;
    bool operator==(const Planes &other) const {
        return disparity_q8 == other.disparity_q8 && reason == other.reason &&
               confidence == other.confidence;
    }
};

struct Images {
    int width, height;
    std::vector<uint8_t> left, right;
    std::vector<rectify_span> left_span, right_span;  // empty: all of every row
    std::vector<uint8_t> left_colour, right_colour;   // empty: none
};

struct Size {
    int width, height;
};

class Random {
  public:
    explicit Random(uint32_t seed) : bits_(seed) {}
    // Between `low` and `high`, both included.
    int between(int low, int high) {
        return low + static_cast<int>(bits_() % static_cast<uint32_t>(high - low + 1));
    }
    bool one_in(int count) { return between(1, count) == 1; }

  private:
    std::mt19937 bits_;
};

uint8_t grey(int value) {
    return static_cast<uint8_t>(std::clamp(value, 0, 255));
}

// A walk along the rows in steps of at most `step`: 255 is noise, 1 is smooth.
std::vector<uint8_t> random_image(Random &random, Size size, int step) {
    std::vector<uint8_t> image(static_cast<size_t>(size.width) * static_cast<size_t>(size.height));
    int value = 128;
    for (uint8_t &pixel : image) {
        value = std::clamp(value + random.between(-step, step), 0, 255);
        pixel = grey(value);
    }
    return image;
}

// The left image moved by disparities that change now and then, with noise.
std::vector<uint8_t> moved_image(Random &random, const std::vector<uint8_t> &left, Size size,
                                 int disparity_min, int disparity_count) {
    std::vector<uint8_t> right(left.size());
    int disparity = 0;
    for (int y = 0; y < size.height; y++) {
        const size_t row = static_cast<size_t>(y) * static_cast<size_t>(size.width);
        for (int x = 0; x < size.width; x++) {
            if (random.one_in(40) || (x == 0 && y == 0)) {
                disparity = disparity_min + random.between(0, disparity_count - 1);
            }
            const int from = std::clamp(x + disparity, 0, size.width - 1);
            right[row + static_cast<size_t>(x)] =
                grey(left[row + static_cast<size_t>(from)] + random.between(-2, 2));
        }
    }
    return right;
}

std::vector<rectify_span> random_spans(Random &random, Size size) {
    std::vector<rectify_span> spans(static_cast<size_t>(size.height));
    for (rectify_span &span : spans) {
        const int begin = random.between(0, size.width / 3);
        const int end = random.one_in(10) ? begin : random.between(begin, size.width);
        span = {static_cast<int16_t>(begin), static_cast<int16_t>(end)};
    }
    return spans;
}

Images random_images(Random &random, Size size, const match_options &options) {
    Images images{size.width, size.height, {}, {}, {}, {}, {}, {}};
    const int steps[] = {255, 60, 12, 2};
    images.left = random_image(random, size, steps[random.between(0, 3)]);
    images.right = random.one_in(3) ? random_image(random, size, steps[random.between(0, 3)])
                                    : moved_image(random, images.left, size, options.disparity_min,
                                                  options.disparity_count);
    if (random.one_in(2)) {
        images.left_span = random_spans(random, size);
        images.right_span = random_spans(random, size);
    }
    for (std::vector<uint8_t> *colour : {&images.left_colour, &images.right_colour}) {
        if (!random.one_in(3)) {
            *colour =
                random_image(random, {3 * size.width, size.height}, steps[random.between(0, 3)]);
        }
    }
    return images;
}

// The initial contents of memory and outputs differ each time: a result that depends on them would
// show.
Planes match(Images &images, match_options options, const match_kernels *kernels,
             const struct parallel *parallel) {
    static uint8_t fill = 0x5a;
    fill = static_cast<uint8_t>(fill * 3 + 1);
    options.kernels = kernels;
    const size_t pixels = images.left.size();
    Planes planes{std::vector<int32_t>(pixels, fill), std::vector<uint8_t>(pixels, fill),
                  std::vector<uint8_t>(pixels, fill)};
    const synthetic::Memory memory(
        match_needs(images.width, images.height, &options, parallel->threads).bytes);
    std::memset(memory.data(), fill, memory.size());
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    const ptrdiff_t stride = images.width;
    const bool whole = images.left_span.empty();
    const match_input input{{images.left.data(), images.width, images.height, stride},
                            {images.right.data(), images.width, images.height, stride},
                            whole ? nullptr : images.left_span.data(),
                            whole ? nullptr : images.right_span.data(),
                            false,
                            {images.left_colour.empty() ? nullptr : images.left_colour.data(),
                             images.width, images.height, 3 * stride},
                            {images.right_colour.empty() ? nullptr : images.right_colour.data(),
                             images.width, images.height, 3 * stride}};
    match_output output{{planes.disparity_q8.data(), images.width, images.height, stride},
                        {planes.reason.data(), images.width, images.height, stride},
                        {planes.confidence.data(), images.width, images.height, stride}};
    REQUIRE(match_run(&input, &options, parallel, nullptr, nullptr, &arena, &output) == ERROR_OK);
    return planes;
}

std::vector<const match_kernels *> levels_here() {
    std::vector<const match_kernels *> levels;
    for (const char *name : level_names) {
        if (match_kernels_named(name) != nullptr) {
            levels.push_back(match_kernels_named(name));
        }
    }
    return levels;
}

// All levels with the same images, against plain C with one thread.
void compare_levels_on(Images &images, const match_options &options,
                       const struct parallel *parallel) {
    const Planes plain = match(images, options, &match_plain_kernels, &parallel_serial);
    CHECK(match(images, options, &match_plain_kernels, parallel) == plain);
    for (const match_kernels *kernels : levels_here()) {
        CAPTURE(std::string(kernels->name));
        CHECK(match(images, options, kernels, parallel) == plain);
    }
}

// With random images of this size and a random range of `count` disparities, for every preset.
void compare_levels(Random &random, Size size, int count) {
    const int lowest = std::max(-MATCH_DISPARITY_LIMIT, -count - 20);
    const int minimum = random.between(lowest, std::min(20, MATCH_DISPARITY_LIMIT - count));
    match_options options = match_default_options(minimum, count);
    options.keep_all = random.one_in(2);
    if (random.one_in(2)) {
        options.extra_below = random.between(0, count - 1);
        options.extra_above = random.between(0, count - 1 - options.extra_below);
        options.disparity_min += options.extra_below;
        options.disparity_count -= options.extra_below + options.extra_above;
    }
    Images images = random_images(random, size, options);
    const int threads = random.between(1, 9);
    const synthetic::Threads pool(threads, static_cast<uint64_t>(count));
    CAPTURE(size.width);
    CAPTURE(size.height);
    CAPTURE(count);
    CAPTURE(minimum);
    CAPTURE(options.keep_all);
    CAPTURE(options.extra_below);
    CAPTURE(options.extra_above);
    CAPTURE(images.left_span.empty());
    CAPTURE(images.left_colour.empty());
    CAPTURE(images.right_colour.empty());
    CAPTURE(threads);
    for (int preset = 0; preset < MATCH_PRESET_COUNT; preset++) {
        options.preset = static_cast<match_preset>(preset);
        CAPTURE(std::string(match_preset_name(options.preset)));
        compare_levels_on(images, options, pool.parallel());
    }
}

Size random_size(Random &random) {
    return {random.between(MATCH_MIN_WIDTH_PX, 130), random.between(MATCH_MIN_HEIGHT_PX, 45)};
}

}  // namespace

TEST_CASE("the fastest level of this processor is the one that is chosen") {
    const auto levels = levels_here();
    for (const char *name : level_names) {
        const bool here = match_kernels_named(name) != nullptr;
        const std::string report =
            name + std::string(here ? ": compared" : ": not on this processor");
        MESSAGE(report);
    }
    CHECK(match_kernels_best() == (levels.empty() ? &match_plain_kernels : levels.back()));
}

TEST_CASE("every level gives the bytes of plain C for every count of disparities") {
    const auto seed = static_cast<uint32_t>(synthetic::test_seed());
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    // Every third of them also has all remainders of the vectors' widths.
    for (int count = 1; count <= 70; count += synthetic::rounds(1, 3)) {
        compare_levels(random, random_size(random), count);
    }
    for (const int count : {79, 80, 81, 96, 100, 128, 129, 160, 191, 255, 256, 257, 300, 1024}) {
        compare_levels(random, random_size(random), count);
    }
}

TEST_CASE("every level gives the bytes of plain C for every size") {
    const auto seed = static_cast<uint32_t>(synthetic::test_seed());
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    for (const int width : {16, 17, 31, 32, 33, 47, 63, 64, 65, 101, 255}) {
        for (const int height : {8, 9, 15, 16, 17, 31, 33}) {
            if (synthetic::kSanitized && height % 8 != 1) {
                continue;
            }
            compare_levels(random, {width, height}, random.between(1, 100));
        }
    }
}

// SPDX-License-Identifier: Apache-2.0
// Every processor level gives the bytes of plain C, on noise (where every branch is taken) and on
// smooth images, for all counts of disparities.
#include "core/match_kernels.h"

#include <doctest/doctest.h>

#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "core/arena.h"
#include "core/error.h"
#include "core/match.h"
#include "synthetic/seed.hpp"

namespace {

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
};

Images random_images(std::mt19937 &random, int width, int height, int smoothness) {
    Images images{width, height, {}, {}};
    images.left.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
    images.right.resize(images.left.size());
    for (auto *image : {&images.left, &images.right}) {
        int value = 128;
        for (uint8_t &pixel : *image) {
            value += static_cast<int>(random() % 255) / smoothness - 127 / smoothness;
            value = value < 0 ? 0 : (value > 255 ? 255 : value);
            pixel = static_cast<uint8_t>(value);
        }
    }
    return images;
}

Planes match(Images &images, match_options options, const match_kernels *kernels) {
    options.kernels = kernels;
    const size_t pixels = images.left.size();
    Planes planes{std::vector<int32_t>(pixels), std::vector<uint8_t>(pixels),
                  std::vector<uint8_t>(pixels)};
    const size_t need = match_need_bytes(images.width, &options, 1);
    // Filled differently each time: a result that depends on fresh memory would show.
    static uint8_t fill = 0x5a;
    fill = static_cast<uint8_t>(fill * 3 + 1);
    std::vector<uint8_t> memory(need, fill);
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    const ptrdiff_t stride = images.width;
    const match_input input{{images.left.data(), images.width, images.height, stride},
                            {images.right.data(), images.width, images.height, stride},
                            nullptr,
                            nullptr,
                            false};
    match_output output{{planes.disparity_q8.data(), images.width, images.height, stride},
                        {planes.reason.data(), images.width, images.height, stride},
                        {planes.confidence.data(), images.width, images.height, stride}};
    REQUIRE(match_run(&input, &options, &parallel_serial, nullptr, nullptr, &arena, &output) ==
            ERROR_OK);
    return planes;
}

}  // namespace

TEST_CASE("every processor level gives the bytes of plain C") {
    const auto seed = static_cast<uint32_t>(synthetic::test_seed());
    MESSAGE("seed " << seed);
    std::mt19937 random(seed);
    int levels = 0;
    for (const char *name : {"sse41", "avx2", "neon"}) {
        const match_kernels *kernels = match_kernels_named(name);
        if (kernels == nullptr) {
            MESSAGE(std::string(name) << ": not on this processor");
            continue;
        }
        levels++;
        for (const int count :
             {1, 2, 15, 16, 17, 31, 32, 33, 48, 64, 80, 96, 100, 128, 160, 1024}) {
            const int width = count == 1024 ? 40 : 16 + static_cast<int>(random() % 120);
            const int height = 8 + static_cast<int>(random() % 30);
            const int minimum = static_cast<int>(random() % 60) - 30;
            const int smoothness = 1 + static_cast<int>(random() % 20);
            Images images = random_images(random, width, height, smoothness);
            match_options options = match_default_options(count == 1024 ? -512 : minimum, count);
            options.keep_all = random() % 2 == 0;
            CAPTURE(name);
            CAPTURE(width);
            CAPTURE(height);
            CAPTURE(count);
            CHECK(match(images, options, kernels) == match(images, options, &match_plain_kernels));
        }
    }
    MESSAGE(levels << " levels compared");
}

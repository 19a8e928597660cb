// SPDX-License-Identifier: Apache-2.0
// The greedy-path baseline on synthetic pairs. tests/portable compares its digest on all
// processors.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "stereo/match/checks.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"

using namespace synthetic;

namespace {

using Grey = std::vector<uint8_t>;

struct Setting {
    int stride_extra = 0;
    std::vector<rectify_span> left_span, right_span;  // empty: all of every row
    std::function<bool(int rows_done, int rows)> progress;
    size_t memory_bytes = 0;  // 0: what match_paper_need_bytes asks for
};

struct Answer {
    Matched matched;
    uint64_t evaluations;
    double evaluations_per_px() const {
        return static_cast<double>(evaluations) / static_cast<double>(matched.reason.size());
    }
};

// `left` and `right` have rows of width + stride_extra.
Answer run_paper(const Grey &left, const Grey &right, int width, int height,
                 const match_options &options, const Setting &setting = {}) {
    Answer answer{};
    Matched &m = answer.matched;
    m.width = width;
    m.height = height;
    m.left = left;
    m.right = right;
    const int stride = width + setting.stride_extra;
    m.input.left = {m.left.data(), width, height, stride};
    m.input.right = {m.right.data(), width, height, stride};
    m.input.left_span = setting.left_span.empty() ? nullptr : setting.left_span.data();
    m.input.right_span = setting.right_span.empty() ? nullptr : setting.right_span.data();
    const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    m.disparity_q8.assign(pixels, INT32_MIN);
    m.reason.assign(pixels, 255);
    m.confidence.assign(pixels, 0);
    m.output.disparity_q8 = {m.disparity_q8.data(), width, height, width};
    m.output.reason = {m.reason.data(), width, height, width};
    m.output.confidence = {m.confidence.data(), width, height, width};
    m.need_bytes = match_paper_need_bytes(width, &options);
    const Memory memory(setting.memory_bytes > 0 ? setting.memory_bytes : m.need_bytes);
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    auto progress = [](void *self, int rows_done, int rows) {
        return (*static_cast<const std::function<bool(int, int)> *>(self))(rows_done, rows);
    };
    std::function<bool(int, int)> called = setting.progress;
    m.status = match_paper_run_counted(&m.input, &options, called ? +progress : nullptr, &called,
                                       &arena, &m.output, &answer.evaluations);
    m.peak_bytes = arena.peak_bytes;
    CHECK(arena.used_bytes == 0);
    return answer;
}

Answer run_paper(const Pair &pair, const match_options &options, const Setting &setting = {}) {
    const int stride = pair.width + setting.stride_extra;
    return run_paper(as_u8(pair.left, pair.width, pair.height, pair.bits, stride),
                     as_u8(pair.right, pair.width, pair.height, pair.bits, stride), pair.width,
                     pair.height, options, setting);
}

bool same_answer(const Matched &a, const Matched &b) {
    return a.status == b.status && a.disparity_q8 == b.disparity_q8 && a.reason == b.reason &&
           a.confidence == b.confidence;
}

Grey random_image(int width, int height, Random &random) {
    Grey image(static_cast<size_t>(width) * static_cast<size_t>(height));
    for (uint8_t &value : image) {
        value = static_cast<uint8_t>(random.bits());
    }
    return image;
}

Pair noisy_pair(const Scene &scene, const Rig &rig, uint64_t seed) {
    RenderOptions options;
    options.left.noise_grey = options.right.noise_grey = 1;
    options.seed = seed;
    return render(scene, rig, options);
}

// Left pixel x shows what the right one at x - shift shows; pixels without a partner are noise.
struct Shifted {
    Grey left, right;
};
Shifted shifted_noise(int width, int height, int shift, Random &random) {
    Shifted pair{random_image(width, height, random), random_image(width, height, random)};
    for (int i = std::max(0, shift); i < width * height + std::min(0, shift); i++) {
        const int x = i % width;
        const bool partner = x >= shift && x < width + shift;
        auto &grey = pair.left[static_cast<size_t>(i)];
        grey = partner ? pair.right[static_cast<size_t>(i - shift)] : grey;
    }
    return pair;
}

// Properties of every result, for any images.
void check_sane(const Answer &answer, const match_options &options, const Setting &setting = {}) {
    const Matched &m = answer.matched;
    int wrong = 0;
    for (size_t i = 0; i < m.reason.size(); i++) {
        const auto y = i / static_cast<size_t>(m.width);
        const int x = static_cast<int>(i % static_cast<size_t>(m.width));
        const rectify_span all = {0, static_cast<int16_t>(m.width)};
        const rectify_span left = setting.left_span.empty() ? all : setting.left_span[y];
        const rectify_span right = setting.right_span.empty() ? all : setting.right_span[y];
        const double disparity = m.disparity_px(i);
        const double x_right = x - disparity;
        const bool border = m.reason[i] == REASON_BORDER;
        wrong += m.reason[i] >= REASON_COUNT || (border && m.confidence[i] != 0);
        wrong += disparity <= options.disparity_min - 1 ||
                 disparity >= options.disparity_min + options.disparity_count;
        wrong += !border && (x < left.begin || x >= left.end);
        wrong += !border && (x_right <= right.begin - 1 || x_right >= right.end);
    }
    CHECK(wrong == 0);
    CHECK((m.status == ERROR_OK && m.peak_bytes <= m.need_bytes));
    CHECK(answer.evaluations_per_px() <= MATCH_PAPER_EVALUATIONS_MAX);
}

}  // namespace

TEST_CASE("a constant shift of noise is matched nearly everywhere, to either side") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    const int width = 200;
    const int height = 40;
    for (const int shift : {0, 1, 7, 31, 60, -1, -20, -60}) {
        CAPTURE(shift);
        const Shifted pair = shifted_noise(width, height, shift, random);
        const match_options options = match_default_options(shift - 30, 64);
        const Answer answer = run_paper(pair.left, pair.right, width, height, options);
        check_sane(answer, options);
        const Matched &m = answer.matched;
        int partners = 0, right = 0, wrong = 0;
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                const bool partner = x >= shift && x < width + shift;
                const bool valid = m.valid(m.index(x, y));
                const bool fits = std::abs(m.disparity_px(m.index(x, y)) - shift) < 0.5;
                partners += partner;
                right += valid && fits && partner;
                wrong += valid && !(fits && partner);
            }
        }
        // Beyond a single jump, the path gets there only by luck.
        CHECK(right > (std::abs(shift) > 32 ? 0.85 : 0.94) * partners);
        CHECK(wrong < 0.02 * partners);
    }
}

TEST_CASE("slanted walls are found to a fraction of a pixel") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 120, 800, 100);
    struct Slant {
        double at_centre, x, y, rms_max;
    };
    for (const Slant &slant :
         {Slant{20, 0, 0, 0.12}, Slant{20.4, 0, 0, 0.2}, Slant{20, 0.05, 0, 0.25},
          Slant{20, -0.05, 0, 0.25}, Slant{20, 0.12, 0.03, 0.35}, Slant{20, 0, 0.08, 0.3}}) {
        INFO("centre ", slant.at_centre, " slant ", slant.x, " ", slant.y);
        const Pair pair =
            noisy_pair(wall(rig, slant.at_centre, slant.x, slant.y, {3, 0.15}, seed), rig, seed);
        const std::vector<bool> chosen = clear_pixels(pair, 4, 8);
        const Answer answer = run_paper(pair, match_default_options(0, 48));
        const Comparison result = compare(answer.matched, pair.left_truth,
                                          [&](int x, int y) { return chosen[pair.index(x, y)]; });
        CHECK(result.valid_share() > 0.85);
        CHECK(result.bad_1px_share() < 0.02);
        CHECK(std::abs(result.bias_px) < 0.08);
        CHECK(result.rms_px < slant.rms_max);
    }
}

TEST_CASE("what has no match is not claimed") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 160, 800, 100);
    const Pair one = noisy_pair(wall(rig, 20, 0, 0, {3, 0.15}, seed), rig, seed);
    Pair unrelated = one;
    unrelated.right = noisy_pair(wall(rig, 20, 0, 0, {3, 0.15}, seed + 1), rig, seed + 1).right;
    Pair noise = one;
    Random random(seed);
    for (auto *image : {&noise.left, &noise.right}) {
        for (uint16_t &value : *image) {
            value = static_cast<uint16_t>(random.bits() & 255);
        }
    }
    Pair swapped = one;  // the true disparities are out of reach
    std::swap(swapped.left, swapped.right);
    for (const Pair *pair : {&unrelated, &noise, &swapped}) {
        CAPTURE(pair == &unrelated);
        CAPTURE(pair == &noise);
        const Answer answer = run_paper(*pair, match_default_options(4, 48));
        CHECK(answer.matched.share(REASON_VALID) < 0.1);
    }
    for (const int grey : {0, 128, 255}) {
        const Grey flat(160 * 40, static_cast<uint8_t>(grey));
        const match_options options = match_default_options(0, 32);
        const Answer answer = run_paper(flat, flat, 160, 40, options);
        check_sane(answer, options);
        CHECK(answer.matched.share(REASON_VALID) == 0);
        CHECK(answer.matched.share(REASON_NO_TEXTURE) == 1);
    }
}

TEST_CASE("a difference of exposure changes nothing") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    Shifted pair = shifted_noise(160, 40, 9, random);
    for (Grey *image : {&pair.left, &pair.right}) {
        std::for_each(image->begin(), image->end(), [](uint8_t &grey) { grey /= 3; });
    }
    const match_options options = match_default_options(0, 32);
    const Matched plain = run_paper(pair.left, pair.right, 160, 40, options).matched;
    CHECK(plain.share(REASON_VALID) > 0.8);
    for (uint8_t &grey : pair.right) {
        grey = static_cast<uint8_t>(2 * grey + 40);
    }
    CHECK(same_answer(run_paper(pair.left, pair.right, 160, 40, options).matched, plain));
}

TEST_CASE("the work per pixel does not grow with the range of disparities") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    Random random(seed);
    const Shifted related = shifted_noise(600, 12, 20, random);
    const Shifted unrelated = shifted_noise(600, 12, 600, random);
    const auto evaluations = [](const Shifted &pair, int count) {
        const match_options options = match_default_options(0, count);
        const Answer answer = run_paper(pair.left, pair.right, 600, 12, options);
        check_sane(answer, options);
        return answer.evaluations_per_px();
    };
    // Unrelated images keep the path lost, which is the maximum of work.
    for (const Shifted *pair : {&related, &unrelated}) {
        const double narrow = evaluations(*pair, 64);
        const double wide = evaluations(*pair, MATCH_MAX_DISPARITIES);
        CAPTURE(pair == &related);
        CHECK(wide < 1.5 * narrow);
        CHECK(wide < (pair == &related ? 60 : 480));
    }
}

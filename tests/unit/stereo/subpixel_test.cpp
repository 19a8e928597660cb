// SPDX-License-Identifier: Apache-2.0
// Sub-pixel refinement, its predicted sigma, and the residual vertical disparity, on synthetic
// pairs with exact ground truth.
#include "stereo/subpixel.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "stereo/row_residual.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"
#include "synthetic/threads.hpp"

using namespace synthetic;

namespace {

constexpr uint8_t kUntouched = 123;
struct Refined {
    Matched matched;
    std::vector<uint8_t> codes;
    int status;
    size_t peak_bytes, need_bytes;
};

Pair noisy_pair(const Scene &scene, const Rig &rig, double noise_grey, uint64_t seed) {
    RenderOptions options;
    options.seed = seed;
    options.left.noise_grey = options.right.noise_grey = noise_grey;
    return render(scene, rig, options);
}

Refined refine(Matched matched, const parallel *parallel = &parallel_serial,
               size_t memory_bytes = 0) {
    Refined result{std::move(matched), {}, 0, 0, 0};
    Matched &m = result.matched;
    m.bind();
    result.codes.assign(m.reason.size(), kUntouched);
    image_u8 sigma = {result.codes.data(), m.width, m.height, m.width};
    result.need_bytes = subpixel_need_bytes(m.width, parallel->threads);
    const Memory memory(memory_bytes > 0 ? memory_bytes : result.need_bytes);
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    subpixel fit;
    result.status = subpixel_begin(&fit, &m.input, parallel, &arena, &m.output, &sigma, false);
    if (result.status == ERROR_OK) {
        subpixel_advance(&fit, m.height);
    }
    result.peak_bytes = arena.peak_bytes;
    return result;
}

// Pixels, disparities and rejected pixels at random, of any size: noise, the same moved by 4 px,
// and only black and white; also all rejected, and none.
Matched random_matches(Random &random, int round) {
    const int width = static_cast<int>(random.uniform(16, 300));
    const int height = static_cast<int>(random.uniform(8, 90));
    const double spread = random.uniform(1, 120000);
    std::vector<uint8_t> left(static_cast<size_t>(width) * static_cast<size_t>(height));
    std::vector<uint8_t> right(left.size());
    for (size_t i = 0; i < left.size(); i++) {
        const uint64_t bits = random.bits();
        const uint64_t rights[] = {bits >> 8, i < 4 ? 0 : left[i - 4] + (bits & 3),
                                   (bits >> 8 & 1) * 255};
        left[i] = static_cast<uint8_t>(round % 3 < 2 ? bits : (bits & 1) * 255);
        right[i] = static_cast<uint8_t>(rights[round % 3]);
    }
    const double valid_share = round % 5 > 0 ? 0.9 : round % 2;
    Matched m = run_match(left, right, width, height, match_default_options(0, 16));
    for (size_t i = 0; i < left.size(); i++) {
        const double most = random.uniform(0, 1) < 0.9 ? 200 : spread;
        m.disparity_q8[i] = static_cast<int32_t>(random.uniform(0, most) - 1000);
        m.reason[i] = random.uniform(0, 1) < valid_share ? REASON_VALID : REASON_NO_TEXTURE;
    }
    return m;
}

// A fit that sees nonsense in all rows but those stated.
class Stream {
  public:
    Stream(const Matched &matched, const parallel *parallel, bool plain)
        : source_(matched),
          shown_(matched),
          codes_(matched.reason.size(), kUntouched),
          memory_(subpixel_need_bytes(matched.width, parallel->threads)) {
        shown_.bind();
        std::fill(shown_.disparity_q8.begin(), shown_.disparity_q8.end(), -77777);
        std::fill(shown_.reason.begin(), shown_.reason.end(), REASON_VALID);
        sigma_ = {codes_.data(), shown_.width, shown_.height, shown_.width};
        arena_init(&arena_, memory_.data(), memory_.size());
        REQUIRE(subpixel_begin(&fit_, &shown_.input, parallel, &arena_, &shown_.output, &sigma_,
                               plain) == ERROR_OK);
    }

    int advance(int rows) {
        for (size_t i = 0; i < shown_.reason.size(); i++) {
            const bool seen = i >= end_of(rows_ - SUBPIXEL_IMAGE_ROWS) && i < end_of(rows);
            shown_.left[i] = static_cast<uint8_t>(seen ? source_.left[i] : ~source_.left[i]);
            shown_.right[i] = static_cast<uint8_t>(seen ? source_.right[i] : ~source_.right[i]);
        }
        for (size_t i = end_of(rows_); i < end_of(rows); i++) {
            shown_.disparity_q8[i] = source_.disparity_q8[i];
            shown_.reason[i] = source_.reason[i];
        }
        rows_ = rows;
        return subpixel_advance(&fit_, rows);
    }

    // Whether the finished rows are those of the whole image, and all others as they were.
    bool holds(const Refined &whole, int finished) const {
        bool result = true;
        for (size_t i = 0; i < end_of(rows_); i++) {
            const bool done = i < end_of(finished);
            const Matched &expected = done ? whole.matched : source_;
            result = result && shown_.disparity_q8[i] == expected.disparity_q8[i] &&
                     codes_[i] == (done ? whole.codes[i] : kUntouched);
        }
        return result;
    }

  private:
    size_t end_of(int rows) const { return shown_.index(0, std::max(rows, 0)); }

    Matched source_, shown_;
    std::vector<uint8_t> codes_;
    Memory memory_;
    arena arena_{};
    image_u8 sigma_{};
    subpixel fit_{};
    int rows_ = 0;
};

// Errors over sigma, of pixels farther from an edge than all windows reach and without gross errors
// (which are the matcher's).
struct Scores {
    double squares = 0;
    int count = 0, beyond_three = 0;

    double rms() const { return std::sqrt(squares / count); }
    void add(double z) {
        squares += z * z;
        count++;
        beyond_three += std::abs(z) > 3;
    }
};

Scores scores_of(const Refined &refined, const Pair &pair) {
    const std::vector<bool> clear = clear_pixels(pair, 8, 10);
    Scores scores;
    for (size_t i = 0; i < clear.size(); i++) {
        const double error = refined.matched.disparity_px(i) - pair.left_truth.disparity_px[i];
        if (clear[i] && refined.matched.valid(i) && std::abs(error) < 1) {
            scores.add(error / (subpixel_sigma_q8(refined.codes[i]) / 256.0));
        }
    }
    return scores;
}

Comparison compare_clear(const Matched &matched, const Pair &pair) {
    const std::vector<bool> clear = clear_pixels(pair, 8, 10);
    return compare(matched, pair.left_truth, [&](int x, int y) { return clear[pair.index(x, y)]; });
}

triangulate_vertical measure_vertical(const Matched &matched) {
    const Memory memory(row_residual_need_bytes());
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    triangulate_vertical vertical{};
    row_residual residual;
    REQUIRE(row_residual_begin(&residual, &matched.input, &matched.output, &arena) == ERROR_OK);
    row_residual_add(&residual, matched.height);
    row_residual_finish(&residual, &vertical);
    CHECK(arena.peak_bytes <= memory.size());
    return vertical;
}

}  // namespace

TEST_CASE("refinement takes out the matcher's pull towards whole disparities") {
    const uint64_t seed = test_seed();
    const Rig rig = rectified_rig(256, 160, 800, 100, -60);
    for (const double disparity : {5.0, 5.2, 5.3, 5.5, 5.8}) {
        const Pair pair = noisy_pair(wall(rig, disparity, 0, 0, {3, 0.15}, seed), rig, 1, seed);
        const Matched raw = run_match(pair, match_default_options(-20, 48));
        REQUIRE(raw.status == ERROR_OK);
        const Comparison before = compare_clear(raw, pair);
        const Refined refined = refine(raw);
        REQUIRE(refined.status == ERROR_OK);
        const Comparison after = compare_clear(refined.matched, pair);
        CAPTURE(disparity);
        CAPTURE(before.bias_px);
        CAPTURE(before.rms_px);
        CAPTURE(after.bias_px);
        CAPTURE(after.rms_px);
        // The bound of Cramer and Rao for a window of 25 pixels here is 0.03 px.
        CHECK(std::abs(after.bias_px) < 0.03);
        CHECK(after.rms_px < 0.07);
        CHECK(after.rms_px < before.rms_px + 0.01);
        CHECK(after.valid == before.valid);
    }
}

TEST_CASE("the predicted sigma is what is found") {
    const uint64_t seed = test_seed();
    const Rig rig = rectified_rig(256, 160, 800, 100, -60);
    Scores all;
    for (const double noise : {1.0, 2.0, 4.0}) {
        for (const double contrast : {0.08, 0.15}) {
            for (const double cell : {2.2, 3.0, 4.0}) {
                for (const double slant : {0.0, 0.12}) {
                    const Pair pair =
                        noisy_pair(wall(rig, 5.3, slant, -slant / 2, {cell, contrast}, seed), rig,
                                   noise, seed);
                    Matched matched = run_match(pair, match_default_options(-32, 72));
                    matched.input.resampled = true;  // the rows are exact, as if of our own
                    const Refined refined = refine(std::move(matched));
                    REQUIRE(refined.status == ERROR_OK);
                    const Scores scores = scores_of(refined, pair);
                    INFO("noise ", noise, " contrast ", contrast, " cell ", cell, " slant ", slant);
                    CAPTURE(scores.rms());
                    REQUIRE(scores.count > 20000);
                    CHECK(scores.rms() > 0.5);
                    CHECK(scores.rms() < 1.5);
                    CHECK(scores.beyond_three < 0.04 * scores.count);
                    all.squares += scores.squares;
                    all.count += scores.count;
                    all.beyond_three += scores.beyond_three;
                }
            }
        }
    }
    MESSAGE("rms of (error / sigma) ", all.rms(), ", beyond three sigma ",
            static_cast<double>(all.beyond_three) / all.count);
    CHECK(all.rms() > 0.8);
    CHECK(all.rms() < 1.25);
    CHECK(all.beyond_three < 0.02 * all.count);
}

TEST_CASE("a scene of planes, sphere, steps and bars gets better, its edges no worse") {
    const uint64_t seed = test_seed();
    const Rig rig = rectified_rig(320, 240, 800, 100);
    const Pair pair = noisy_pair(everything(rig, 40, {3, 0.15}, seed), rig, 1, seed);
    const Matched raw = run_match(pair, match_default_options(0, 48));
    REQUIRE(raw.status == ERROR_OK);
    const Refined refined = refine(raw);
    const auto seen = [&](int x, int y) {
        return pair.left_truth.visibility[pair.index(x, y)] == Visibility::Visible;
    };
    const Comparison before = compare(raw, pair.left_truth, seen);
    const Comparison after = compare(refined.matched, pair.left_truth, seen);
    CAPTURE(before.rms_px);
    CAPTURE(after.rms_px);
    CHECK(after.rms_px < 0.8 * before.rms_px);
    CHECK(after.bad_1px <= before.bad_1px * 1.1 + 20);
    CHECK(std::abs(compare_clear(refined.matched, pair).bias_px) < 0.02);
}

TEST_CASE("only valid pixels change, by two pixels at most, and only they have a sigma") {
    const uint64_t seed = test_seed();
    const Rig rig = rectified_rig(160, 120, 800, 100);
    const Pair pair = noisy_pair(everything(rig, 40, {3, 0.15}, seed), rig, 2, seed);
    const Matched raw = run_match(pair, match_default_options(0, 48));
    const Refined refined = refine(raw);
    REQUIRE(refined.status == ERROR_OK);
    int wrong = 0, moved = 0;
    for (size_t i = 0; i < raw.reason.size(); i++) {
        const int32_t step_q8 = refined.matched.disparity_q8[i] - raw.disparity_q8[i];
        moved += step_q8 != 0;
        wrong += step_q8 > 512 || step_q8 < -512;
        wrong += !raw.valid(i) && (step_q8 != 0 || refined.codes[i] != 0);
        wrong += raw.valid(i) && refined.codes[i] == 0;
    }
    CHECK(wrong == 0);
    CHECK(moved > 1000);
    CHECK(refined.matched.reason == raw.reason);
    CHECK(refined.matched.confidence == raw.confidence);
}

TEST_CASE("refinement is the same for any number of threads, in the memory promised") {
    const uint64_t seed = test_seed();
    const Rig rig = rectified_rig(600, 130, 800, 100);
    const Pair pair = noisy_pair(everything(rig, 40, {3, 0.15}, seed), rig, 2, seed);
    const Matched raw = run_match(pair, match_default_options(0, 48));
    const Refined serial = refine(raw);
    REQUIRE(serial.status == ERROR_OK);
    CHECK(serial.peak_bytes <= serial.need_bytes);
    for (int threads = 2; threads <= 8; threads += 2) {
        const Threads pool(threads, seed);
        const Refined refined = refine(raw, pool.parallel());
        CHECK(refined.status == ERROR_OK);
        CHECK(refined.matched.disparity_q8 == serial.matched.disparity_q8);
        CHECK(refined.codes == serial.codes);
        CHECK(refined.peak_bytes <= refined.need_bytes);
    }
    CHECK(refine(raw, &parallel_serial, serial.peak_bytes - 64).status == ERROR_MEMORY);
}

TEST_CASE("rows in batches give the same from any pixels, and only those stated are read") {
    const uint64_t seed = test_seed();
    Random random(seed);
    for (int round = 0; round < 36; round++) {
        const Matched raw = random_matches(random, round);
        const Refined whole = refine(raw);
        REQUIRE(whole.status == ERROR_OK);
        measure_vertical(whole.matched);
        const Threads pool(1 + round % 4, seed);
        Stream stream(raw, pool.parallel(), round % 2 == 0);
        CAPTURE(raw.width);
        CAPTURE(raw.height);
        int rows = 0;
        while (rows < raw.height) {
            rows = std::min(raw.height, rows + static_cast<int>(random.uniform(0, 40)));
            const int finished = stream.advance(rows);
            CHECK(finished == (rows == raw.height ? rows : std::max(0, rows - 10)));
            CHECK(stream.holds(whole, finished));
        }
    }
}

TEST_CASE("residual vertical disparity is measured to a twentieth of a pixel") {
    const uint64_t seed = test_seed();
    const VerticalShift shifts[] = {{0, 0, 0},          {0.3, 0, 0},      {-1.2, 0, 0},
                                    {0.5, 0.004, 0},    {-0.4, 0, 0.003}, {0.2, -0.002, 0.002},
                                    {1.6, 0.002, 0.001}};
    for (const VerticalShift &shift : shifts) {
        CAPTURE(shift.offset_px);
        CAPTURE(shift.slope_x);
        CAPTURE(shift.slope_y);
        Rig rig = rectified_rig(256, 192, 800, 100, -60);
        rig.right.vertical = shift;
        const Pair pair = noisy_pair(wall(rig, 5.3, 0.03, 0.02, {3, 0.15}, seed), rig, 1, seed);
        const Matched matched = run_match(pair, match_default_options(-20, 48));
        REQUIRE(matched.status == ERROR_OK);
        const triangulate_vertical vertical = measure_vertical(matched);
        REQUIRE(vertical.samples >= 50);
        double worst = 0;
        for (int y = 12; y < pair.height - 12; y += 12) {
            for (int x = 24; x < pair.width - 12; x += 12) {
                const size_t i = pair.index(x, y);
                if (pair.left_truth.visibility[i] != Visibility::Visible) {
                    continue;
                }
                const double fitted = vertical.offset_px + vertical.slope_x * (x - pair.width / 2) +
                                      vertical.slope_y * (y - pair.height / 2);
                worst = std::max(worst, std::abs(fitted - pair.left_truth.vertical_px[i]));
            }
        }
        CAPTURE(worst);
        CHECK(worst < 0.05);
        CHECK(vertical.rms_px < 0.1);
        // Large errors at the edges show there, even if the middle is good.
        const double max = std::abs(shift.offset_px) + std::abs(shift.slope_x) * 128 +
                           std::abs(shift.slope_y) * 96;
        CHECK(vertical.trend_px <= max + 0.05);
        CHECK(vertical.trend_px >= 0.6 * max - 0.05);
        CHECK(vertical.curve_px < 0.05);
    }
}

TEST_CASE("without texture the vertical disparity is called unmeasured") {
    const Rig rig = rectified_rig(160, 120, 800, 100);
    Builder builder(rig, 1);
    Scene flat;
    flat.surfaces.push_back(builder.plane(20, 0, 0, Builder::constant(0.4)));
    const triangulate_vertical vertical =
        measure_vertical(run_match(render(flat, rig, {}), match_default_options(0, 32)));
    CHECK(vertical.samples == 0);
    CHECK(vertical.offset_px == 0);
    CHECK(vertical.median_px == 0);
}

TEST_CASE("stripes along x contain no information about the rows") {
    const Rig rig = rectified_rig(160, 120, 800, 100);
    Builder builder(rig, 1);
    Scene scene;
    scene.surfaces.push_back(builder.plane(20, 0, 0, builder.stripes(20, 37, 0.3)));
    match_options options = match_default_options(0, 32);
    options.keep_all = true;
    CHECK(measure_vertical(run_match(render(scene, rig, {}), options)).samples == 0);
}

TEST_CASE("too little memory is refused by both") {
    const uint64_t seed = test_seed();
    const Rig rig = rectified_rig(96, 64, 800, 100);
    const Pair pair = noisy_pair(wall(rig, 10, 0, 0, {3, 0.15}, seed), rig, 1, seed);
    const Matched matched = run_match(pair, match_default_options(0, 16));
    const Memory memory(64);
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    row_residual residual;
    CHECK(row_residual_begin(&residual, &matched.input, &matched.output, &arena) == ERROR_MEMORY);
}

// SPDX-License-Identifier: Apache-2.0
// Results of the matcher on synthetic pairs, compared with their exact ground truth. The rest of
// its contract (sizes, memory, threads, errors) is in match_contract_test.cpp.
#include "stereo/match/match.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/seed.hpp"

using namespace synthetic;

namespace {

// No edge nearer than the census window and one pixel of uncertainty at a surface's edge.
constexpr int kEdge = 3;
constexpr int kBorder = 4;

RenderOptions noisy(double noise_grey, uint64_t seed) {
    RenderOptions options;
    options.left.noise_grey = options.right.noise_grey = noise_grey;
    options.seed = seed;
    return options;
}

Comparison compare_clear(const Matched &matched, const Pair &pair) {
    const std::vector<bool> clear = clear_pixels(pair, kEdge, kBorder);
    return compare(matched, pair.left_truth, [&](int x, int y) { return clear[pair.index(x, y)]; });
}

Comparison compare_surface(const Matched &matched, const Pair &pair, int surface) {
    const std::vector<bool> clear = clear_pixels(pair, kEdge, kBorder);
    return compare(matched, pair.left_truth, [&](int x, int y) {
        const size_t i = pair.index(x, y);
        return clear[i] && pair.left_truth.surface[i] == surface;
    });
}

Comparison compare_hidden(const Matched &matched, const Pair &pair, Visibility visibility) {
    return compare(matched, pair.left_truth, [&](int x, int y) {
        return pair.left_truth.visibility[pair.index(x, y)] == visibility;
    });
}

// A plane: its disparity in the middle of the left image, and what it gains a column and a row.
struct Plane {
    double middle, along, down;
};

// Both views of a plane with texture that is as fine, on the mean, in both images.
class SteepPair {
  public:
    static constexpr int kWidth = 320, kHeight = 160;

    SteepPair(const Plane &plane, uint64_t seed) : plane_(plane), texture_(kTexels * kHeight) {
        Random random(seed);
        // Fine and coarse structure of like contrast.
        std::vector<double> coarse(texture_.size());
        for (size_t i = 0; i < texture_.size(); i++) {
            coarse[i] = random.normal();
            const size_t y = i / kTexels / kCoarse * kCoarse;
            texture_[i] = random.normal() + coarse[y * kTexels + i % kTexels / kCoarse * kCoarse];
        }
        for (const int stride : {1, 1, 1, 1, kTexels, kTexels, kTexels, kTexels}) {
            for (size_t i = 0; i + static_cast<size_t>(stride) < texture_.size(); i++) {
                texture_[i] += texture_[i + static_cast<size_t>(stride)];
            }
        }
        double squares = 0;
        for (const double texel : texture_) {
            squares += texel * texel;
        }
        const double rms = std::sqrt(squares / static_cast<double>(texture_.size()));
        for (double &texel : texture_) {
            texel /= rms;
        }
        for (int y = 0; y < kHeight; y++) {
            for (int x = 0; x < kWidth; x++) {
                left.push_back(grey_at(x, y, random));
                // The left column whose right one is x.
                const double from = x + disparity(0, y);
                right.push_back(grey_at(from / (1 - plane.along), y, random));
            }
        }
    }

    double disparity(double x, double y) const {
        return plane_.middle + plane_.along * (x - kWidth / 2.0) +
               plane_.down * (y - kHeight / 2.0);
    }

    std::vector<uint8_t> left, right;

  private:
    static constexpr int kTexels = 3 * kWidth, kCoarse = 6;

    uint8_t grey_at(double x, int y, Random &random) const {
        const double u = std::clamp(x - disparity(x, y) / 2 + kWidth, 0.0, kTexels - 2.0);
        const size_t i = static_cast<size_t>(y) * kTexels + static_cast<size_t>(u);
        const double share = u - std::floor(u);
        const double texel = texture_[i] * (1 - share) + texture_[i + 1] * share;
        const double grey = 128 + 30 * texel + 0.7 * random.normal();
        return static_cast<uint8_t>(std::clamp(grey, 0.0, 255.0));
    }

    Plane plane_;
    std::vector<double> texture_;
};

}  // namespace

TEST_CASE("walls of any slant are found to a fraction of a pixel") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    // Disparities of both signs: the rig is verged.
    const Rig rig = rectified_rig(256, 160, 800, 100, -60);
    struct Slant {
        double x, y;
    };
    for (const Slant slant : {Slant{0, 0}, Slant{0.05, 0}, Slant{0, 0.1}, Slant{0.1, -0.1},
                              Slant{-0.1, 0.1}, Slant{0.2, 0}, Slant{-0.2, 0}}) {
        for (const double noise : {0.0, 2.0}) {
            CAPTURE(slant.x);
            CAPTURE(slant.y);
            CAPTURE(noise);
            const Pair pair =
                render(wall(rig, 3.3, slant.x, slant.y, {3, 0.15}, seed), rig, noisy(noise, seed));
            const Matched matched = run_match(pair, match_default_options(-40, 88));
            REQUIRE(matched.status == ERROR_OK);
            const Comparison result = compare_clear(matched, pair);
            CAPTURE(result.valid_share());
            CAPTURE(result.bad_1px_share());
            CAPTURE(result.rms_px);
            CHECK(result.valid_share() > 0.95);
            CHECK(result.bad_1px_share() < 0.01);
            // Whole disparities alone have an rms error of 0.29.
            CHECK(result.rms_px < 0.25);
        }
    }
}

TEST_CASE("planes as steep as 1.5 disparities a column and 2 a row are found") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    match_options options = match_default_options(-80, 220);
    struct Limit {
        Plane plane;
        double standard, best;  // share of the visible pixels
    };
    for (const Limit &limit : {Limit{{30, 0.5, 0}, 0.6, 0.92}, Limit{{30, -1, 0}, 0.75, 0.92},
                               Limit{{30, -1.5, 0}, 0.4, 0.6}, Limit{{30, 0, 1.5}, 0.85, 0.93},
                               Limit{{30, 0, -1.5}, 0.85, 0.93}, Limit{{30, 0, 2}, 0.8, 0.85},
                               Limit{{30, 0, -2}, 0.6, 0.8}, Limit{{30, 0.3, 1}, 0.85, 0.93},
                               Limit{{30, -0.5, 1.5}, 0.85, 0.95}}) {
        const SteepPair pair(limit.plane, seed);
        for (const match_preset preset : {MATCH_PRESET_STANDARD, MATCH_PRESET_BEST}) {
            options.preset = preset;
            const Matched matched =
                run_match(pair.left, pair.right, pair.kWidth, pair.kHeight, options);
            REQUIRE(matched.status == ERROR_OK);
            int seen = 0, right = 0, wrong = 0;
            for (int y = 0; y < pair.kHeight; y++) {
                for (int x = 0; x < pair.kWidth; x++) {
                    const double truth = pair.disparity(x, y);
                    const bool in_image = x - truth > 4 && x - truth < pair.kWidth - 5;
                    if (in_image && truth > -76 && truth < 136) {
                        const size_t i = matched.index(x, y);
                        const bool near = std::abs(matched.disparity_px(i) - truth) <= 1;
                        seen++;
                        right += matched.valid(i) && near;
                        wrong += matched.valid(i) && !near;
                    }
                }
            }
            CAPTURE(std::string(match_preset_name(preset)));
            CAPTURE(limit.plane.along);
            CAPTURE(limit.plane.down);
            CAPTURE(seen);
            const double share = preset == MATCH_PRESET_BEST ? limit.best : limit.standard;
            CHECK(right > share * seen);
            CHECK(wrong < 0.05 * seen);
        }
    }
}

TEST_CASE("planes, sphere, steps and bars of one scene are all found") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(320, 240, 800, 100);
    const Scene scene = everything(rig, 40, {3, 0.15}, seed);
    const Pair pair = render(scene, rig, noisy(1, seed));
    const Matched matched = run_match(pair, match_default_options(0, 48));
    REQUIRE(matched.status == ERROR_OK);
    const Comparison all = compare_clear(matched, pair);
    CHECK(all.valid_share() > 0.97);
    CHECK(all.bad_1px_share() < 0.01);
    CHECK(all.rms_px < 0.25);
    for (int surface = 0; surface < static_cast<int>(scene.surfaces.size()); surface++) {
        const Comparison one = compare_surface(matched, pair, surface);
        CAPTURE(surface);
        CAPTURE(one.pixels);
        CAPTURE(one.valid_share());
        CAPTURE(one.bad_1px_share());
        if (one.pixels > 200) {
            CHECK(one.valid_share() > 0.9);
            CHECK(one.bad_1px_share() < 0.03);
        }
    }
}

TEST_CASE("small objects far in front of a wall are found") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    constexpr int kCount = 224, kWall = 30, kObject = 170, kSide = 36;
    const Rig rig = rectified_rig(640, 240, 800, 100);
    Builder builder(rig, seed);
    Scene scene = wall(rig, kWall, 0, 0, {3, 0.15}, seed);
    for (int i = 0; i < 4; i++) {
        scene.surfaces.push_back(builder.piece(kObject, 230 + 100 * i, 30 + 40 * i, kSide, kSide,
                                               builder.noise(kObject, 3, 0.15)));
    }
    const Pair pair = render(scene, rig, noisy(1, seed));
    for (const match_preset preset :
         {MATCH_PRESET_FAST, MATCH_PRESET_STANDARD, MATCH_PRESET_BEST}) {
        match_options options = match_default_options(0, kCount);
        options.preset = preset;
        const Matched matched = run_match(pair, options);
        REQUIRE(matched.status == ERROR_OK);
        CAPTURE(match_preset_name(preset));
        for (int i = 1; i <= 4; i++) {
            const Comparison object = compare_surface(matched, pair, i);
            CAPTURE(i);
            CAPTURE(object.pixels);
            CHECK(object.pixels > 500);
            CHECK(object.valid_share() > 0.9);
            CHECK(object.bad_1px_share() < 0.03);
        }
    }
}

// At a quarter of the size, where `standard` looks for all surfaces, a bar of 5 or 6 pixels has no
// two of its own.
TEST_CASE("bars of a few pixels are found") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(320, 160, 800, 100);
    constexpr int kWidths[] = {5, 6, 8, 11};
    for (const double jump : {4.0, 8.0, 14.0}) {
        Builder builder(rig, seed);
        Scene scene = wall(rig, 12, 0, 0, {2.5, 0.15}, seed);
        for (int i = 0; i < 4; i++) {
            scene.surfaces.push_back(builder.piece(12 + jump, 60 + 60 * i, 10, kWidths[i], 140,
                                                   builder.noise(12 + jump, 2.5, 0.15)));
        }
        const Pair pair = render(scene, rig, noisy(1, seed));
        for (const match_preset preset : {MATCH_PRESET_STANDARD, MATCH_PRESET_BEST}) {
            match_options options = match_default_options(0, 48);
            options.preset = preset;
            const Matched matched = run_match(pair, options);
            REQUIRE(matched.status == ERROR_OK);
            for (int i = 0; i < 4; i++) {
                const Comparison bar = compare(matched, pair.left_truth, [&](int x, int y) {
                    return pair.left_truth.surface[pair.index(x, y)] == i + 1;
                });
                const double right = bar.valid_share() * (1 - bar.bad_1px_share());
                CAPTURE(match_preset_name(preset));
                CAPTURE(jump);
                CAPTURE(kWidths[i]);
                // Four seeds: 0.63 and more of the bars of 8 and 11 pixels; best 0.93, and 0.59 of
                // the others.
                const bool wide = kWidths[i] >= 8;
                const bool best = preset == MATCH_PRESET_BEST;
                CHECK((!(wide || best) || right > (wide && best ? 0.85 : 0.5)));
            }
        }
    }
}

TEST_CASE("pixels that one camera cannot see are not called valid") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(320, 240, 800, 100);
    for (const double jump : {6.0, 12.0, 24.0}) {
        CAPTURE(jump);
        const Pair pair = render(step(rig, 10 + jump, 10, {3, 0.15}, seed), rig, noisy(1, seed));
        const Matched matched = run_match(pair, match_default_options(0, 48));
        REQUIRE(matched.status == ERROR_OK);
        const Comparison hidden = compare_hidden(matched, pair, Visibility::Occluded);
        const Comparison outside = compare_hidden(matched, pair, Visibility::Outside);
        CAPTURE(hidden.pixels);
        CAPTURE(hidden.valid_share());
        CAPTURE(outside.valid_share());
        REQUIRE(hidden.pixels > 500);
        REQUIRE(outside.pixels > 1000);
        // A window of five pixels cannot distinguish the first two columns next to an edge from the
        // adjacent surface: 2 of `jump` columns.
        CHECK(hidden.valid_share() < 0.05 + 2 / jump);
        CHECK(outside.valid_share() < 0.15);
        // Most of the pixels reported as occluded are occluded.
        int called = 0, right = 0;
        for (size_t i = 0; i < matched.reason.size(); i++) {
            if (matched.reason[i] == REASON_OCCLUDED) {
                called++;
                right += pair.left_truth.visibility[i] != Visibility::Visible;
            }
        }
        CAPTURE(called);
        CAPTURE(right);
        CHECK(right > 0.6 * called);
    }
}

TEST_CASE("a surface without texture says so") {
    const Rig rig = rectified_rig(160, 96, 800, 100);
    for (const double grey : {0.0, 0.5, 1.0}) {
        Builder builder(rig, 1);
        Scene scene;
        scene.surfaces.push_back(builder.plane(12, 0, 0, Builder::constant(grey)));
        const Pair pair = render(scene, rig, {});
        const Matched matched = run_match(pair, match_default_options(0, 32));
        REQUIRE(matched.status == ERROR_OK);
        CAPTURE(grey);
        CHECK(matched.share(REASON_VALID) == 0);
        CHECK(matched.share(REASON_NO_TEXTURE) > 0.6);
    }
}

TEST_CASE("a textureless window in a textured wall is left empty") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 160, 800, 100);
    Builder builder(rig, seed);
    Scene scene = wall(rig, 12, 0, 0, {3, 0.15}, seed);
    scene.surfaces.push_back(builder.piece(20, 90, 40, 100, 80, Builder::constant(0.45)));
    const Pair pair = render(scene, rig, noisy(1, seed));
    const Matched matched = run_match(pair, match_default_options(0, 32));
    REQUIRE(matched.status == ERROR_OK);
    // Farther from its rim than the texture window, nothing may be wrongly accepted.
    int pixels = 0, wrong = 0;
    for (int y = 60; y < 100; y++) {
        for (int x = 110; x < 170; x++, pixels++) {
            const size_t i = matched.index(x, y);
            wrong += matched.valid(i) && std::abs(matched.disparity_px(i) - 20) > 1;
        }
    }
    CAPTURE(wrong);
    CHECK(wrong < 0.1 * pixels);
}

// As the painted bands of a mug: alone they might be off, but the surface around shows where they
// are.
TEST_CASE("a band along the rows is kept within a textured surface") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    constexpr int kBegin = 64, kEnd = 96;
    const Rig rig = rectified_rig(256, 160, 800, 100);
    Pair pair = render(wall(rig, 12, 0.1, 0, {3, 0.15}, seed), rig, noisy(1, seed));
    for (int y = kBegin; y < kEnd; y++) {
        for (int x = 0; x < pair.width; x++) {
            const int stripe = y / 4 % 2 == 0 ? 30 : 170;
            pair.left[pair.index(x, y)] =
                static_cast<uint8_t>(stripe + pair.left[pair.index(x, y)] / 8);
            pair.right[pair.index(x, y)] =
                static_cast<uint8_t>(stripe + pair.right[pair.index(x, y)] / 8);
        }
    }
    match_options options = match_default_options(0, 32);
    options.preset = MATCH_PRESET_BEST;
    const Matched matched = run_match(pair, options);
    REQUIRE(matched.status == ERROR_OK);
    const Comparison band = compare(matched, pair.left_truth, [&](int x, int y) {
        return x >= 40 && x < pair.width - 8 && y >= kBegin && y < kEnd;
    });
    CAPTURE(band.valid_share());
    CAPTURE(band.bad_1px_share());
    CHECK(band.valid_share() > 0.9);
    CHECK(band.bad_1px_share() < 0.05);
}

TEST_CASE("repeated stripes are called ambiguous") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 96, 800, 100);
    for (const double period : {6.0, 8.0, 11.0}) {
        Builder builder(rig, seed);
        Scene scene;
        scene.surfaces.push_back(builder.plane(20, 0, 0, builder.stripes(20, period, 0.25)));
        const Pair pair = render(scene, rig, noisy(1, seed));
        // Near a coarser surface, most other good matches are never searched.
        match_options options = match_default_options(0, 64);
        options.preset = MATCH_PRESET_BEST;
        const Matched matched = run_match(pair, options);
        REQUIRE(matched.status == ERROR_OK);
        // Farther from the left border than the disparities reach, so that all of them can be
        // chosen.
        std::array<int, REASON_COUNT> count{};
        for (int y = 0; y < pair.height; y++) {
            for (int x = 64; x < pair.width; x++) {
                count[matched.reason[matched.index(x, y)]]++;
            }
        }
        const int pixels = pair.height * (pair.width - 64);
        CAPTURE(period);
        CAPTURE(count[REASON_VALID]);
        CAPTURE(count[REASON_AMBIGUOUS]);
        CAPTURE(count[REASON_OCCLUDED]);
        CAPTURE(count[REASON_SPECKLE]);
        // Where five or more disparities fit equally well, a result is a guess. Winners that jump
        // from period to period also fail the left-right check, which is then the reported reason.
        CHECK(count[REASON_VALID] < 0.25 * pixels);
        CHECK(count[REASON_AMBIGUOUS] > 0.15 * pixels);
    }
}

TEST_CASE("what lies outside the searched range is not claimed inside it") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 160, 800, 100);
    const Pair pair = render(step(rig, 40, 16, {3, 0.15}, seed), rig, noisy(1, seed));
    const Matched matched = run_match(pair, match_default_options(0, 28));
    REQUIRE(matched.status == ERROR_OK);
    const Comparison near = compare_surface(matched, pair, 1);
    REQUIRE(near.pixels > 2000);
    CAPTURE(near.valid_share());
    CHECK(near.valid_share() < 0.34);  // up to 0.30 with seven seeds
    CHECK(compare_surface(matched, pair, 0).valid_share() > 0.9);
}

TEST_CASE("a noisy pair is smoothed, and its surface is found") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 160, 800, 100);
    const Scene scene = wall(rig, 12, 0.1, 0, {6, 0.15}, seed);
    struct Limit {
        // Not smoothed: 0.87, 0.056 of the first; 0.67, 0.108 of the last. Weakly: 0.904 of the
        // second.
        double noise_grey, valid_share, bad_1px_share;
    };
    for (const Limit &limit :
         {Limit{1.5, 0.89, 0.045}, Limit{2.7, 0.91, 0.045}, Limit{6, 0.8, 0.105}}) {
        const Pair pair = render(scene, rig, noisy(limit.noise_grey, seed));
        const Matched matched = run_match(pair, match_default_options(0, 48));
        REQUIRE(matched.status == ERROR_OK);
        const Comparison all = compare_clear(matched, pair);
        CAPTURE(limit.noise_grey);
        CAPTURE(all.valid_share());
        CAPTURE(all.bad_1px_share());
        CHECK(all.valid_share() > limit.valid_share);
        CHECK(all.bad_1px_share() < limit.bad_1px_share);
    }
}

TEST_CASE("keep_all rejects nothing but borders") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(192, 96, 800, 100);
    const Pair pair = render(step(rig, 20, 10, {3, 0.15}, seed), rig, noisy(1, seed));
    match_options options = match_default_options(0, 32);
    options.keep_all = true;
    const Matched matched = run_match(pair, options);
    REQUIRE(matched.status == ERROR_OK);
    CHECK(matched.share(REASON_VALID) + matched.share(REASON_BORDER) == 1);
    CHECK(matched.share(REASON_VALID) > 0.8);
}

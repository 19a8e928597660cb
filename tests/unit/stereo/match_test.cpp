// SPDX-License-Identifier: Apache-2.0
// Results of the matcher on synthetic pairs, compared with their exact ground truth. The rest of
// its contract (sizes, memory, threads, errors) is in match_contract_test.cpp.
#include "stereo/match/match.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

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

TEST_CASE("weak texture, strong noise and other exposure are survived") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 160, 800, 100);
    struct Case {
        const char *name;
        double contrast, noise;
        Sensor right;
        double valid_min, bad_max;
    };
    Sensor brighter;
    brighter.gain = 1.25;
    brighter.offset = -0.04;
    Sensor darker;
    darker.gain = 0.7;
    darker.gamma = 1.15;
    Sensor clipped;
    clipped.gain = 1.9;  // a good third of the scene is saturated
    for (const Case &test : {Case{"plain", 0.15, 0, {}, 0.98, 0.003},
                             Case{"2 grey levels of texture over noise", 0.03, 2, {}, 0.95, 0.02},
                             Case{"noise of 8", 0.15, 8, {}, 0.93, 0.02},
                             Case{"brighter", 0.15, 1, brighter, 0.97, 0.005},
                             Case{"darker, other gamma", 0.15, 1, darker, 0.97, 0.005},
                             Case{"clipped", 0.15, 1, clipped, 0.6, 0.03}}) {
        CAPTURE(test.name);
        RenderOptions options;
        options.seed = seed;
        options.right = test.right;
        options.left.noise_grey = options.right.noise_grey = test.noise;
        const Pair pair =
            render(wall(rig, 20.4, 0.03, 0.02, {2.5, test.contrast}, seed), rig, options);
        const Matched matched = run_match(pair, match_default_options(0, 48));
        REQUIRE(matched.status == ERROR_OK);
        const Comparison result = compare_clear(matched, pair);
        CAPTURE(result.valid_share());
        CAPTURE(result.bad_1px_share());
        CHECK(result.valid_share() > test.valid_min);
        CHECK(result.bad_1px_share() < test.bad_max);
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

TEST_CASE("bars of a few pixels stand out from the wall") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 160, 800, 100);
    Builder builder(rig, seed);
    Scene scene = wall(rig, 12, 0, 0, {2.5, 0.15}, seed);
    const int widths[] = {5, 6, 8, 12};
    for (int i = 0; i < 4; i++) {
        const double disparity = 17 + 2.5 * i;
        // Bars narrower than the five pixels of the census window are lost, as with other matchers
        // (see the oracle test).
        scene.surfaces.push_back(builder.piece(disparity, 50 + 50 * i, 20, widths[i], 120,
                                               builder.noise(disparity, 2.5, 0.15)));
    }
    const Pair pair = render(scene, rig, noisy(1, seed));
    const Matched matched = run_match(pair, match_default_options(0, 32));
    REQUIRE(matched.status == ERROR_OK);
    for (int i = 0; i < 4; i++) {
        // The whole bar counts, except the columns that mix bar and wall.
        const Comparison bar = compare(matched, pair.left_truth, [&](int x, int y) {
            return pair.left_truth.surface[pair.index(x, y)] == i + 1 && y >= 24 && y < 136;
        });
        CAPTURE(widths[i]);
        CAPTURE(bar.valid_share());
        CAPTURE(bar.bad_1px_share());
        CHECK(bar.valid_share() > 0.8);
        CHECK(bar.bad_1px_share() < 0.15);
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

TEST_CASE("nearer things have larger disparities, at the same place in the image") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(192, 96, 800, 100);
    double last = -1;
    for (const double disparity : {5.0, 8.0, 8.5, 9.0, 14.0, 25.5, 40.0}) {
        const Pair pair = render(wall(rig, disparity, 0, 0, {3, 0.15}, seed), rig, noisy(1, seed));
        const Matched matched = run_match(pair, match_default_options(0, 48));
        REQUIRE(matched.status == ERROR_OK);
        std::vector<double> there;
        for (int y = 40; y < 56; y++) {
            for (int x = 80; x < 150; x++) {
                if (matched.valid(matched.index(x, y))) {
                    there.push_back(matched.disparity_px(matched.index(x, y)));
                }
            }
        }
        REQUIRE(there.size() > 1000);
        std::nth_element(there.begin(), there.begin() + 500, there.end());
        CHECK(there[500] > last);
        CHECK(there[500] == doctest::Approx(disparity).epsilon(0.03));
        last = there[500];
    }
}

TEST_CASE("seen in a mirror the surface is the same") {
    // Not by construction: costs are aggregated along the left image's edges, and consistency is
    // checked for the left image's winners. So the two results are compared where both are valid.
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(320, 240, 800, 100);
    const Pair pair = render(everything(rig, 40, {3, 0.15}, seed), rig, noisy(1, seed));
    const Matched straight = run_match(pair, match_default_options(0, 48));
    const Matched reversed = run_match(mirrored(pair), match_default_options(0, 48));
    REQUIRE(straight.status == ERROR_OK);
    REQUIRE(reversed.status == ERROR_OK);
    int compared = 0, differing = 0;
    int visible = 0, both = 0;
    for (int y = 0; y < pair.height; y++) {
        for (int x = 0; x < pair.width; x++) {
            const size_t i = straight.index(x, y);
            visible += pair.left_truth.visibility[i] == Visibility::Visible;
            const int x_right = static_cast<int>(std::lround(x - straight.disparity_px(i)));
            if (!straight.valid(i) || x_right < 0 || x_right >= pair.width) {
                continue;
            }
            const size_t mirror = reversed.index(pair.width - 1 - x_right, y);
            if (!reversed.valid(mirror)) {
                continue;
            }
            both += pair.left_truth.visibility[i] == Visibility::Visible;
            compared++;
            differing += std::abs(reversed.disparity_px(mirror) - straight.disparity_px(i)) > 1;
        }
    }
    CAPTURE(compared);
    CAPTURE(differing);
    CHECK(both > 0.9 * visible);
    CHECK(differing < 0.01 * compared);
    // The mirrored result meets its own ground truth as well as the original one.
    const Comparison mirror_truth = compare_clear(reversed, mirrored(pair));
    CHECK(mirror_truth.valid_share() > 0.97);
    CHECK(mirror_truth.bad_1px_share() < 0.01);
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
        CHECK(count[REASON_AMBIGUOUS] > 0.25 * pixels);
    }
}

TEST_CASE("images that have nothing to do with each other give next to nothing") {
    const uint64_t seed = test_seed();
    INFO("VERGENCE_SEED=", seed);
    const Rig rig = rectified_rig(256, 160, 800, 100);
    const Pair one = render(wall(rig, 20, 0, 0, {3, 0.15}, seed), rig, noisy(1, seed));
    const Pair other = render(wall(rig, 20, 0, 0, {3, 0.15}, seed + 1), rig, noisy(1, seed + 1));
    Pair unrelated = one;
    unrelated.right = other.right;
    // Pure noise, and the swapped pair with the true disparities out of reach.
    Pair noise = one;
    Random random(seed);
    for (auto *image : {&noise.left, &noise.right}) {
        for (uint16_t &value : *image) {
            value = static_cast<uint16_t>(random.bits() & 255);
        }
    }
    Pair swapped = one;
    std::swap(swapped.left, swapped.right);
    for (const Pair *pair : {&unrelated, &noise, &swapped}) {
        const Matched matched = run_match(*pair, match_default_options(4, 48));
        REQUIRE(matched.status == ERROR_OK);
        CAPTURE(pair == &unrelated);
        CAPTURE(pair == &noise);
        // Chance: 48 candidates per pixel and a smooth path through them. Three-way SGBM accepts
        // three quarters of such a pair (see the oracle test).
        CHECK(matched.share(REASON_VALID) < 0.12);
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
    CHECK(near.valid_share() < 0.15);
    CHECK(compare_surface(matched, pair, 0).valid_share() > 0.9);
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

// SPDX-License-Identifier: Apache-2.0
// Two pictures compared at every shift: the same scene, shifted, turned, or another one.
#include "stereo/image/picture_view.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "synthetic/seed.hpp"

namespace {

constexpr int kWidth = 480, kHeight = 360, kCell = 10;

using Scene = std::vector<std::vector<int>>;  // blocks of 2 x 2 cells, with light of 0 .. 200

Scene random_scene(std::mt19937_64 &random) {
    std::uniform_int_distribution<int> shade(0, 200);
    Scene scene(size_t(kHeight / kCell / 2), std::vector<int>(size_t(3 * kWidth / kCell / 2)));
    for (auto &row : scene) {
        std::generate(row.begin(), row.end(), [&] { return shade(random); });
    }
    return scene;
}

// The scene from `left_px` on, at this gain.
picture_view seen(const Scene &scene, int left_px, double gain, const picture_form &form) {
    picture_view_sums sums;
    picture_view_begin(&sums, &form, kHeight);
    const int depth = 1 << (form.bits - 8);
    for (int y = 0; y < kHeight; y++) {
        std::vector<uint16_t> row;
        for (int x = 0; x < kWidth; x++) {
            const int light = scene[size_t(y / kCell / 2)][size_t((left_px + x) / kCell / 2)];
            const bool green = x % 2 == y % 2;
            const double colour = form.mosaic && !green ? 0.3 : 1;
            row.insert(row.end(), size_t(form.channels), uint16_t(light * gain * colour * depth));
        }
        picture_view_row(&sums, row.data());
    }
    picture_view view;
    picture_view_end(&sums, &view);
    return view;
}

constexpr picture_form kGrey8 = {kWidth, 8, 1, false};

picture_overlay compared(const picture_view &first, const picture_view &second,
                         picture_turn turn = PICTURE_AS_IS) {
    return picture_view_compare(&first, &second, turn, -PICTURE_VIEW_MAX_DX, PICTURE_VIEW_MAX_DX);
}

}  // namespace

TEST_CASE("the same scene is found at its shift, whatever light, depth and layout") {
    std::mt19937_64 random(synthetic::test_seed());
    const Scene scene = random_scene(random);
    const picture_view left = seen(scene, kWidth, 1, kGrey8);
    for (const picture_form &form :
         {kGrey8, picture_form{kWidth, 10, 1, true}, picture_form{kWidth, 12, 3, false}}) {
        const picture_overlay same = compared(left, seen(scene, kWidth, 0.3, form));
        CHECK(same.score_permille > 980);
        CHECK(same.dx == 0);
        CHECK(same.dy == 0);
        CHECK(same.overlap_permille == 1000);
        // Column x of the first is 12 cells further left in the second.
        const picture_overlay moved = compared(left, seen(scene, kWidth + 12 * kCell, 1, form));
        CHECK(moved.score_permille > 800);
        CHECK(moved.dx == 12);
        CHECK(moved.overlap_permille == 750);
        const picture_overlay back = compared(left, seen(scene, kWidth - 30 * kCell, 1, form));
        CHECK(back.dx == -30);
        CHECK(back.overlap_permille == 375);
    }
}

TEST_CASE("a turned picture is alike once it is turned back") {
    std::mt19937_64 random(synthetic::test_seed());
    const picture_view left = seen(random_scene(random), 0, 1, kGrey8);
    for (const picture_turn turn : {PICTURE_ROTATED, PICTURE_FLIPPED, PICTURE_MIRRORED}) {
        CAPTURE(turn);
        picture_view turned = left;
        for (auto &row : turned.cell) {
            if (turn != PICTURE_FLIPPED) {
                std::reverse(std::begin(row), std::end(row));
            }
        }
        for (int y = 0; turn != PICTURE_MIRRORED && y < PICTURE_VIEW_ROWS / 2; y++) {
            std::swap(turned.cell[y], turned.cell[PICTURE_VIEW_ROWS - 1 - y]);
        }
        CHECK(compared(left, turned, turn).score_permille > 980);
        CHECK(compared(left, turned).score_permille < 400);
    }
}

TEST_CASE("other scenes, and pictures of nothing, are not alike") {
    std::mt19937_64 random(synthetic::test_seed());
    const picture_view left = seen(random_scene(random), 0, 1, kGrey8);
    CHECK(compared(left, seen(random_scene(random), 0, 1, kGrey8)).score_permille < 400);
    CHECK(compared(left, seen(random_scene(random), 0, 0, kGrey8)).score_permille == 0);
    // Too small for cells.
    const picture_form small = {95, 16, 3, false};
    picture_view_sums sums;
    picture_view_begin(&sums, &small, 1);
    const std::vector<uint16_t> row(size_t(3) * 95, UINT16_MAX);
    picture_view_row(&sums, row.data());
    picture_view nothing;
    picture_view_end(&sums, &nothing);
    CHECK(compared(left, nothing).score_permille == 0);
    CHECK(compared(nothing, nothing).score_permille == 0);
}

// SPDX-License-Identifier: Apache-2.0
// The matcher's checks of what is around a pixel compared with the slow ones of
// match_reference_blocks.cpp, on surfaces of which more or less is textured, and more or less
// passed the checks of single pixels.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <set>

#include "core/arena.h"
#include "core/error.h"
#include "match_reference.hpp"
#include "stereo/image/reason.h"
#include "stereo/match/checks.h"
#include "stereo/match/tuning.h"
#include "synthetic/matched.hpp"
#include "synthetic/seed.hpp"

using reference::Answer;
using reference::Grid;
using reference::Search;
using reference::Span;
using reference::View;

namespace {

constexpr int kPatch = 20;
constexpr int kBorder = 10;
constexpr int kDoubts[] = {REASON_OCCLUDED, REASON_OCCLUDED, REASON_AMBIGUOUS, REASON_NO_TEXTURE,
                           REASON_OUT_OF_RANGE};

class Generator {
  public:
    int between(int lowest, int highest) {
        return std::uniform_int_distribution<int>(lowest, highest)(engine_);
    }
    bool one_in(int count) { return between(1, count) == 1; }

  private:
    std::mt19937_64 engine_{synthetic::test_seed()};
};

struct Pair {
    View left, right;
    Answer answer;  // result of the checks of single pixels
};

// Patches of a surface: contrast of the texture, grey levels; accepted pixels, percent; disparity.
struct Patches {
    Grid<int> contrast, accepted, disparity;
};

// At most `accepted` percent are.
Patches random_patches(Generator &generator, int columns, int rows, int accepted) {
    Patches patches = {{columns, rows}, {columns, rows}, {columns, rows}};
    for (size_t i = 0; i < patches.contrast.cells.size(); i++) {
        patches.contrast.cells[i] = generator.one_in(4) ? generator.between(0, 20) : 0;
        patches.accepted.cells[i] = accepted - generator.between(0, 3) * generator.between(0, 18);
        patches.disparity.cells[i] = generator.one_in(6) ? generator.between(8, 30) : 8;
    }
    return patches;
}

View grey_view(int width, int height) {
    return {Grid<uint8_t>(width, height, 100),
            std::vector<Span>(static_cast<size_t>(height), Span{0, width})};
}

// Rows differ by up to `stripes` grey levels; at most `accepted` percent of the pixels are; the
// lowest margin.
Pair random_pair(Generator &generator, int width, int height, int stripes, int accepted,
                 int margin) {
    Pair pair = {grey_view(width, height),
                 grey_view(width, height),
                 {{width, height}, {width, height}, {width, height}}};
    const Patches patches =
        random_patches(generator, width / kPatch + 1, height / kPatch + 1, accepted);
    for (int y = 0; y < height; y++) {
        const int row = generator.between(0, stripes);
        for (int x = 0; x < width; x++) {
            const int contrast = patches.contrast.at(x / kPatch, y / kPatch);
            const int disparity = patches.disparity.at(x / kPatch, y / kPatch);
            const int grey = 120 + row + generator.between(-contrast, contrast);
            pair.left.grey.at(x, y) = static_cast<uint8_t>(grey + generator.between(-1, 1));
            if (x >= disparity) {
                pair.right.grey.at(x - disparity, y) =
                    static_cast<uint8_t>(grey + generator.between(-1, 1));
            }
            pair.answer.disparity_q8.at(x, y) = 256 * disparity + generator.between(-300, 300);
            pair.answer.confidence.at(x, y) = generator.between(margin, margin + 25);
            const bool is_accepted =
                generator.between(1, 100) <= patches.accepted.at(x / kPatch, y / kPatch);
            const int reason = is_accepted ? REASON_VALID : kDoubts[generator.between(0, 4)];
            pair.answer.reason.at(x, y) = x < kBorder ? REASON_BORDER : reason;
        }
    }
    return pair;
}

Grid<int> checked_reasons(Pair pair, const Search &search, int smoothing) {
    const int width = pair.left.grey.width;
    const int height = pair.left.grey.height;
    match_options options =
        match_default_options(search.disparity_min, search.disparity_count - search.extra_above);
    options.extra_above = search.extra_above;
    match_input input = {};
    input.left = {pair.left.grey.cells.data(), width, height, width};
    input.right = {pair.right.grey.cells.data(), width, height, width};
    Grid<int32_t> disparity_q8(width, height);
    Grid<uint8_t> reason(width, height), confidence(width, height);
    for (size_t i = 0; i < reason.cells.size(); i++) {
        disparity_q8.cells[i] = pair.answer.disparity_q8.cells[i];
        reason.cells[i] = static_cast<uint8_t>(pair.answer.reason.cells[i]);
        confidence.cells[i] = static_cast<uint8_t>(pair.answer.confidence.cells[i]);
    }
    match_output output = {{disparity_q8.cells.data(), width, height, width},
                           {reason.cells.data(), width, height, width},
                           {confidence.cells.data(), width, height, width}};
    const synthetic::Memory memory(match_check_blocks_need_bytes(width, height, 1));
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    match_look look;
    match_look_at(&input, &look);
    look.smoothing = smoothing;
    REQUIRE(match_check_blocks(&input, &options, &look, &parallel_serial, &arena, &output) ==
            ERROR_OK);
    Grid<int> result(width, height);
    std::copy(reason.cells.begin(), reason.cells.end(), result.cells.begin());
    return result;
}

}  // namespace

TEST_CASE("what is around a pixel is judged as the reference does") {
    INFO("VERGENCE_SEED=", synthetic::test_seed());
    Generator generator;
    std::set<int> changes;
    for (int round = 0; round < 24; round++) {
        CAPTURE(round);
        const int smoothing = round % 2 == 0 ? TUNE_SMOOTHING_COARSE : TUNE_SMOOTHING_WEAK;
        Search search = {0, 40, 0, false};
        search.extra_above = round % 4 < 2 ? 0 : 8;
        const Pair pair = random_pair(generator, generator.between(150, 210),
                                      generator.between(100, 150), round % 3 == 0 ? 20 : 2,
                                      round % 4 == 3 ? 72 : 100, generator.between(0, 10) * 5);
        Answer expected = pair.answer;
        reference::check_neighbourhood(pair.left, pair.right, search,
                                       smoothing == TUNE_SMOOTHING_COARSE, &expected);
        const Grid<int> reasons = checked_reasons(pair, search, smoothing);
        int differing = 0;
        for (size_t i = 0; i < reasons.cells.size(); i++) {
            differing += reasons.cells[i] != expected.reason.cells[i];
            if (pair.answer.reason.cells[i] != reasons.cells[i]) {
                changes.insert(reasons.cells[i]);
            }
        }
        CHECK(differing == 0);
    }
    CHECK(changes ==
          std::set<int>{REASON_VALID, REASON_OCCLUDED, REASON_NO_TEXTURE, REASON_AMBIGUOUS});
}

TEST_CASE("pixels that only their cost rejects are kept where enough others are") {
    INFO("VERGENCE_SEED=", synthetic::test_seed());
    Generator generator;
    Pair pair = random_pair(generator, 160, 120, 2, 100, 0);
    for (const int percent : {50, 70}) {  // around TUNE_SHARE_ANY_COST
        for (int y = 0; y < 120; y++) {
            for (int x = 0; x < 160; x++) {
                pair.left.grey.at(x, y) = static_cast<uint8_t>(generator.between(80, 120));
                pair.answer.disparity_q8.at(x, y) = 8 * 256 + generator.between(-100, 100);
                pair.answer.confidence.at(x, y) = TUNE_MARGIN_MIN;
                pair.answer.reason.at(x, y) =
                    generator.between(1, 100) <= percent ? REASON_VALID : REASON_OUT_OF_RANGE;
            }
        }
        const Grid<int> reasons = checked_reasons(pair, {0, 40, 0, false}, TUNE_SMOOTHING_WEAK);
        const auto rejected =
            std::count(reasons.cells.begin(), reasons.cells.end(), REASON_OUT_OF_RANGE);
        CHECK((rejected == 0) == (percent > 60));
    }
}

TEST_CASE("what an object hides is rejected as the reference does") {
    INFO("VERGENCE_SEED=", synthetic::test_seed());
    Generator generator;
    constexpr int kWidth = 200, kHeight = 400;
    for (const bool spans : {false, true}) {
        View left = grey_view(kWidth, kHeight);
        Answer answer = {{kWidth, kHeight}, {kWidth, kHeight}, {kWidth, kHeight}};
        for (int y = 0; y < kHeight; y++) {
            // Rows of plain pieces, alike for some rows, and of runs of one reason.
            int grey = 100, reason = REASON_VALID;
            for (int x = 0; x < kWidth; x++) {
                const int next = generator.between(40, 200);
                grey = generator.one_in(16) ? next : grey;
                const int above = y % 8 == 0 ? grey : left.grey.at(x, y - 1) + 1;
                left.grey.at(x, y) = static_cast<uint8_t>(above + generator.between(-1, 1));
                reason = generator.one_in(4)
                             ? (generator.one_in(2) ? int{REASON_VALID}
                                                    : kDoubts[generator.between(0, 4)])
                             : reason;
                answer.reason.at(x, y) = reason;
            }
            const int begin = spans ? generator.between(0, 20) : 0;
            const int end = spans ? generator.between(kWidth - 20, kWidth) : kWidth;
            left.spans[static_cast<size_t>(y)] = {begin, end};
        }
        const uint32_t noise_q8 = 128;
        Grid<uint8_t> reasons(kWidth, kHeight);
        std::copy(answer.reason.cells.begin(), answer.reason.cells.end(), reasons.cells.begin());
        for (int y = 0; y < kHeight; y++) {
            const std::vector<int> row = reference::smooth_row(left, y);
            const std::vector<uint16_t> smooth(row.begin(), row.end());
            match_reject_hidden(smooth.data() + 2, noise_q8, kWidth, &reasons.at(0, y));
        }
        const Grid<int> before = answer.reason;
        reference::reject_hidden(left, noise_q8, &answer);
        int differing = 0, rejected = 0;
        for (size_t i = 0; i < reasons.cells.size(); i++) {
            differing += reasons.cells[i] != answer.reason.cells[i];
            rejected += before.cells[i] != answer.reason.cells[i];
        }
        CHECK(differing == 0);
        CHECK(rejected > 500);
    }
}

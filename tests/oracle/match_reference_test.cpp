// SPDX-License-Identifier: Apache-2.0
// The matcher compared bit by bit with the slow one of match_reference.hpp, at every processor
// level: from random costs, and from images, to reasons.
#include "match_reference.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "core/arena.h"
#include "core/error.h"
#include "stereo/image/reason.h"
#include "stereo/match/kernels.h"
#include "stereo/match/match.h"
#include "stereo/match/probe.h"
#include "synthetic/matched.hpp"
#include "synthetic/seed.hpp"

using reference::Answer;
using reference::Grid;
using reference::Lanes;
using reference::Place;
using reference::Search;
using reference::Slopes;
using reference::Span;
using reference::Sums;
using reference::View;
using reference::Volume;

namespace {

struct Level {
    std::string name;
    const match_kernels *kernels;
};

// Those supported by this processor.
std::vector<Level> levels() {
    std::vector<Level> all = {{"plain", nullptr}};
#if defined(__x86_64__)
    all.push_back({"sse41", nullptr});
    all.push_back({"avx2", nullptr});
#endif
    std::vector<Level> present;
    for (Level level : all) {
        level.kernels = match_kernels_named(level.name.c_str());
        if (level.kernels == nullptr) {
            MESSAGE(level.name << ": not on this processor");
        } else {
            present.push_back(level);
        }
    }
    return present;
}

// Random numbers of a test that reports how to replay it.
class Generator {
  public:
    Generator() : random_(static_cast<uint32_t>(synthetic::test_seed())) {
        MESSAGE("VERGENCE_SEED=" << synthetic::test_seed());
    }
    // [low, high]
    int between(int low, int high) {
        return low + static_cast<int>(random_() % static_cast<uint32_t>(high - low + 1));
    }

  private:
    std::mt19937 random_;
};

// Grey levels with steps of at most `step` along a row and between rows.
Grid<uint8_t> random_grey(Generator &generator, int width, int height, int step) {
    Grid<uint8_t> grey(width, height);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const int left = x > 0 ? grey.at(x - 1, y) : 128;
            const int above = y > 0 ? grey.at(x, y - 1) : left;
            const int value = (x > 0 ? (left + above) / 2 : above) + generator.between(-step, step);
            grey.at(x, y) = static_cast<uint8_t>(std::clamp(value, 0, 255));
        }
    }
    return grey;
}

// Without texture: columns [x_begin, x_end) of rows [y_begin, y_end).
void fill(Grid<uint8_t> *grey, int x_begin, int x_end, int y_begin, int y_end, int value) {
    for (int y = y_begin; y < y_end; y++) {
        for (int x = x_begin; x < x_end; x++) {
            grey->at(x, y) = static_cast<uint8_t>(value);
        }
    }
}

// Red, green and blue around the grey levels; `step` 0: equal to them.
std::vector<Grid<uint8_t>> random_channels(Generator &generator, const Grid<uint8_t> &grey,
                                           int step) {
    std::vector<Grid<uint8_t>> channels(3, grey);
    for (Grid<uint8_t> &channel : channels) {
        for (uint8_t &level : channel.cells) {
            level =
                static_cast<uint8_t>(std::clamp(level + generator.between(-step, step), 0, 255));
        }
    }
    return channels;
}

std::vector<uint8_t> interleaved(const std::vector<Grid<uint8_t>> &channels) {
    std::vector<uint8_t> pixels;
    for (size_t i = 0; !channels.empty() && i < channels[0].cells.size(); i++) {
        for (const Grid<uint8_t> &channel : channels) {
            pixels.push_back(channel.cells[i]);
        }
    }
    return pixels;
}

View whole(const Grid<uint8_t> &grey) {
    return {grey, std::vector<Span>(static_cast<size_t>(grey.height), Span{0, grey.width})};
}

// Each pixel the mean of 7x7.
Grid<uint8_t> out_of_focus(const Grid<uint8_t> &grey) {
    Grid<uint8_t> result = grey;
    for (int y = 0; y < grey.height; y++) {
        for (int x = 0; x < grey.width; x++) {
            int sum = 0;
            for (int i = 0; i < 49; i++) {
                sum += grey.at(std::clamp(x + i % 7 - 3, 0, grey.width - 1),
                               std::clamp(y + i / 7 - 3, 0, grey.height - 1));
            }
            result.at(x, y) = static_cast<uint8_t>(sum / 49);
        }
    }
    return result;
}

// The right camera's view of the left image: two surfaces with a step between them, one slanted
// both ways, with noise.
Grid<uint8_t> seen_from_right(Generator &generator, const Grid<uint8_t> &left, const Search &search,
                              int noise) {
    Grid<uint8_t> right = random_grey(generator, left.width, left.height, 20);
    const int far = search.disparity_min + generator.between(0, search.disparity_count - 1);
    const int near = search.disparity_min + generator.between(0, search.disparity_count - 1);
    const int lean = generator.between(2, 12);
    for (int y = 0; y < left.height; y++) {
        for (int x = 0; x < left.width; x++) {
            const int from_edge = x - left.width / 2;
            const int disparity = from_edge < 0 ? far : near + y / lean + from_edge / (14 - lean);
            const int right_x = x - disparity;
            if (right_x >= 0 && right_x < left.width) {
                const int value = left.at(x, y) + generator.between(-noise, noise);
                right.at(right_x, y) = static_cast<uint8_t>(std::clamp(value, 0, 255));
            }
        }
    }
    return right;
}

std::vector<rectify_span> spans_of(const View &view) {
    std::vector<rectify_span> spans;
    for (const Span span : view.spans) {
        spans.push_back({static_cast<int16_t>(span.begin), static_cast<int16_t>(span.end)});
    }
    return spans;
}

struct Task {
    View left, right;
    Search search;
    match_preset preset;  // one whose finest level has all rows
    int width() const { return left.grey.width; }
    int height() const { return left.grey.height; }
};

// The matcher's own result, the disparities that its finest level searched, and the slopes that it
// followed.
struct Matched {
    Answer answer;
    Grid<Span> windows;
    Grid<Slopes> slopes;
    Grid<int> doubtful;
};

// What the finest level searched, by pixel; and costs that replace its own: `lanes` a pixel, if
// any.
struct Searched {
    Grid<match_probe_window> windows;
    const std::vector<uint8_t> &averages;
    size_t lanes;
};

void look(void *self, const match_probe_row *row) {
    if (row->level != 0 || row->event != MATCH_PROBE_COSTS) {
        return;
    }
    REQUIRE((row->shift_x == 0 && row->shift_y == 0));
    Searched &searched = *static_cast<Searched *>(self);
    for (int x = 0; x < row->width; x++) {
        const match_probe_window window = match_probe_window_at(row, x);
        searched.windows.at(x, row->y) = window;
        if (!searched.averages.empty()) {
            const size_t pixel = static_cast<size_t>(row->y * row->width + x);
            std::copy_n(searched.averages.begin() +
                            static_cast<std::ptrdiff_t>(pixel * searched.lanes) + window.first,
                        window.count, const_cast<uint8_t *>(row->cost_along) + window.cell);
        }
    }
}

// `averages`: costs to be used instead of those of the images; may be empty.
Matched matched(Task task, const match_kernels *kernels, const std::vector<uint8_t> &averages) {
    const int width = task.width();
    const int height = task.height();
    Searched searched = {{width, height}, averages, static_cast<size_t>(task.search.lanes())};
    const match_probe probed = match_probe_of(kernels, look, &searched);
    const Search &search = task.search;
    match_options options =
        match_default_options(search.disparity_min + search.extra_below,
                              search.disparity_count - search.extra_below - search.extra_above);
    options.extra_below = search.extra_below;
    options.extra_above = search.extra_above;
    options.preset = task.preset;
    options.speckle_px = task.search.speckle_px;
    options.keep_all = task.search.keep_all;
    options.kernels = &probed.kernels;
    const std::vector<rectify_span> left_spans = spans_of(task.left);
    const std::vector<rectify_span> right_spans = spans_of(task.right);
    std::vector<uint8_t> left_colour = interleaved(task.left.channels);
    std::vector<uint8_t> right_colour = interleaved(task.right.channels);
    const match_input input = {{task.left.grey.cells.data(), width, height, width},
                               {task.right.grey.cells.data(), width, height, width},
                               left_spans.data(),
                               right_spans.data(),
                               false,
                               {left_colour.data(), width, height, 3 * width},
                               {right_colour.data(), width, height, 3 * width}};
    Grid<int32_t> disparity_q8(width, height, INT32_MIN);
    Grid<uint8_t> reason(width, height, 255), confidence(width, height, 255);
    match_output output = {{disparity_q8.cells.data(), width, height, width},
                           {reason.cells.data(), width, height, width},
                           {confidence.cells.data(), width, height, width}};
    const synthetic::Memory memory(match_needs(width, height, &options, 1).bytes);
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    REQUIRE(match_run(&input, &options, &parallel_serial, nullptr, nullptr, &arena, &output) ==
            ERROR_OK);
    Matched result = {{{width, height}, {width, height}, {width, height}},
                      {width, height},
                      {width, height},
                      {width, height}};
    for (size_t i = 0; i < searched.windows.cells.size(); i++) {
        result.answer.disparity_q8.cells[i] = disparity_q8.cells[i];
        result.answer.reason.cells[i] = reason.cells[i];
        result.answer.confidence.cells[i] = confidence.cells[i];
        const match_probe_window &window = searched.windows.cells[i];
        result.windows.cells[i] = {window.first, window.first + window.count};
        result.slopes.cells[i] = {window.slope_down, window.slope_along};
        result.doubtful.cells[i] = window.doubtful;
    }
    return result;
}

void check_plane(const char *plane, const Grid<int> &ours, const Grid<int> &theirs) {
    int differing = 0;
    for (int y = 0; y < ours.height; y++) {
        for (int x = 0; x < ours.width; x++) {
            if (ours.at(x, y) != theirs.at(x, y) && differing++ == 0) {
                MESSAGE(std::string(plane) << " at " << x << ", " << y << ": matcher "
                                           << ours.at(x, y) << ", reference " << theirs.at(x, y));
            }
        }
    }
    CHECK_MESSAGE(differing == 0, std::string(plane) << " of " << ours.width << "x" << ours.height
                                                     << " pixels differ: " << differing);
}

void check_same(const Answer &ours, const Answer &theirs) {
    check_plane("disparity_q8", ours.disparity_q8, theirs.disparity_q8);
    check_plane("reason", ours.reason, theirs.reason);
    check_plane("confidence", ours.confidence, theirs.confidence);
}

// Statistics of a round of comparisons.
struct Met {
    std::set<int> reasons;
    std::set<int> smoothings;
    int narrow = 0;  // pixels that did not search everything
    int slanted_down = 0, slanted_along = 0;
};

// Compares all levels' results with the reference's. `all`: costs averaged along the rows to be
// used instead of those of the images; NULL: those.
void check_task(const Task &task, const Volume *all, Met *met) {
    CAPTURE(task.width());
    CAPTURE(task.height());
    CAPTURE(task.search.disparity_min);
    CAPTURE(task.search.disparity_count);
    CAPTURE(task.search.keep_all);
    CAPTURE(match_preset_name(task.preset));
    std::vector<uint8_t> bytes;
    for (size_t i = 0; all != nullptr && i < all->cells.size(); i++) {
        bytes.insert(bytes.end(), all->cells[i].begin(), all->cells[i].end());
    }
    // The searched disparities follow from the coarser levels, which are not tested here.
    const Matched searched = matched(task, &match_plain_kernels, bytes);
    const Grid<Span> &windows = searched.windows;
    const int side = smoothing_of(task.left, task.right);
    const View left = smoothed(task.left, side);
    const View right = smoothed(task.right, side);
    const Volume averages =
        all != nullptr
            ? windowed(*all, windows)
            : row_averages(left,
                           windowed(costs_of(left, right, task.search, searched.slopes), windows),
                           searched.slopes);
    met->smoothings.insert(side);
    const Answer expected =
        decide(task.left, task.right, task.search,
               sum_up(left, task.search, averages, searched.slopes), searched.doubtful);
    for (const Level &level : levels()) {
        CAPTURE(level.name);
        check_same(matched(task, level.kernels, bytes).answer, expected);
    }
    met->reasons.insert(expected.reason.cells.begin(), expected.reason.cells.end());
    for (const Span window : windows.cells) {
        met->narrow += window.end - window.begin < task.search.lanes();
    }
    for (const Slopes slopes : searched.slopes.cells) {
        met->slanted_down += slopes.down != 0;
        met->slanted_along += slopes.along != 0;
    }
}

constexpr match_preset kPresets[] = {MATCH_PRESET_STANDARD, MATCH_PRESET_BEST, MATCH_PRESET_BOARD};

constexpr int kCostMax = 117;

// Random costs; about half of the pixels get a surface of low ones.
Volume random_costs(Generator &generator, int width, int height, int lanes) {
    Volume costs(width, height);
    int surface = 0;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            if (generator.between(0, 19) == 0) {
                surface = generator.between(0, 2 * lanes);
            }
            for (int lane = 0; lane < lanes; lane++) {
                const int away = std::abs(lane - surface);
                const int max = away == 0 ? 10 : (away == 1 ? 30 : kCostMax);
                costs.at(x, y).push_back(generator.between(0, max));
            }
        }
    }
    return costs;
}

}  // namespace

TEST_CASE("averages, paths and winners are the reference's on random costs") {
    Generator generator;
    Met met;
    for (const int count : {1, 2, 3, 16, 31, 33, 48, 64, 80, 100}) {
        const int width = generator.between(16, 80);
        const int height = generator.between(8, 40);
        const Search search = {generator.between(-20, 10), count, 5, count % 2 == 0};
        View left = whole(random_grey(generator, width, height, generator.between(1, 60)));
        if (count % 3 != 0) {
            left.channels = random_channels(generator, left.grey, generator.between(0, 30));
        }
        const View right = whole(seen_from_right(generator, left.grey, search, 2));
        const Volume costs = random_costs(generator, width, height, search.lanes());
        check_task({left, right, search, kPresets[count % 3]}, &costs, &met);
    }
    MESSAGE("pixels with a narrow window: " << met.narrow);
}

TEST_CASE("from images to reasons, every pixel is the reference's") {
    Generator generator;
    Generator colours;
    Met met;
    for (int round = 0; round < 20; round++) {
        // Every other time large enough for coarser levels.
        const bool large = round % 2 == 0;
        const int width = large ? generator.between(64, 100) : generator.between(16, 63);
        const int height = large ? generator.between(32, 50) : generator.between(8, 40);
        Search search = {generator.between(-12, 12),
                         large ? generator.between(17, 64) : generator.between(1, 50),
                         generator.between(0, 30), round % 4 == 3};
        if (round % 3 > 0) {
            search.extra_below = generator.between(0, search.disparity_count / 3);
            search.extra_above = generator.between(0, search.disparity_count / 3);
        }
        const int step = round % 3 == 0 ? generator.between(1, 8) : generator.between(40, 200);
        View left = whole(random_grey(generator, width, height, step));
        if (round % 5 < 2) {
            const int grey = left.grey.at(width / 2, height / 2);
            fill(&left.grey, width / 4, 3 * width / 4, height / 4, height, grey);
        }
        if (round % 5 == 4) {
            left.grey = out_of_focus(left.grey);
        }
        if (round % 4 > 0) {
            left.channels = random_channels(colours, left.grey, round % 4 == 1 ? 0 : 10 * round);
        }
        View right = whole(seen_from_right(generator, left.grey, search, round % 7));
        if (round % 8 > 2) {
            right.channels = random_channels(colours, right.grey, round % 8 == 6 ? 0 : round);
        }
        check_task({left, right, search, kPresets[round % 3]}, nullptr, &met);
    }
    MESSAGE("pixels with a narrow window: " << met.narrow
                                            << ", with a slope down: " << met.slanted_down
                                            << ", along: " << met.slanted_along);
    CHECK(met.narrow > 0);
    CHECK(met.slanted_down > 0);
    CHECK(met.slanted_along > 0);
    // The matcher fills nothing, and keeps disparities beyond infinity valid.
    CHECK(met.reasons.size() == REASON_COUNT - 2);
    CHECK(met.smoothings == std::set<int>{0, 2, 4, 5});
}

TEST_CASE("rows that are valid in parts only, by any spans") {
    Generator generator;
    Met met;
    for (int round = 0; round < 12; round++) {
        const int width = generator.between(20, 80);
        const int height = generator.between(8, 40);
        const Search search = {generator.between(-20, 5), generator.between(10, 40), 10,
                               round % 4 == 3};
        View left = whole(random_grey(generator, width, height, 60));
        left.channels = random_channels(generator, left.grey, 20);
        View right = whole(seen_from_right(generator, left.grey, search, 2));
        right.channels = random_channels(generator, right.grey, 10);
        for (View *view : {&left, &right}) {
            for (Span &span : view->spans) {
                if (generator.between(0, 2) == 0) {
                    span.begin = generator.between(0, width);
                    span.end = generator.between(span.begin, width);
                }
            }
        }
        check_task({left, right, search, kPresets[round % 3]}, nullptr, &met);
    }
}

TEST_CASE("a neighbour's weight falls as 0.9 (1 - step / 112)^8") {
    double furthest = 0;
    for (int step = 0; step < 256; step++) {
        const double formula = 0.9 * std::pow(1 - std::min(step, 112) / 112.0, 8);
        furthest = std::max(furthest, std::abs(reference::edge_weight(step) / 65536 - formula));
    }
    MESSAGE("off by up to " << furthest);
    CHECK(furthest < 0.002);
}

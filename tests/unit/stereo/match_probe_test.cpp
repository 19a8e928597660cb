// SPDX-License-Identifier: Apache-2.0
// The probe reports every row of every level once per event, reports the inputs of the choice of
// winners, and changes nothing.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "stereo/match/probe.h"
#include "synthetic/matched.hpp"
#include "synthetic/scenes.hpp"
#include "synthetic/threads.hpp"

using namespace synthetic;

namespace {

constexpr int width = 150, height = 61, disparity_min = -3, disparity_count = 70;

const Pair &pair_of_test() {
    static const Pair pair = [] {
        const Rig rig = rectified_rig(width, height, 400, 50);
        RenderOptions options;
        options.samples = 1;
        options.left.noise_grey = options.right.noise_grey = 1;
        return render(step(rig, 25, 5, {3, 0.15}, 7), rig, options);
    }();
    return pair;
}

/// The events of one run; rows come from several threads.
struct Seen {
    std::mutex mutex;
    std::map<std::tuple<int, int, int>, int> times;        // key: event, level and row
    std::map<int, int> heights;                            // key: level
    std::map<std::pair<int, int>, std::vector<int>> best;  // key: level and row; -2: not compared
    int differing = 0, compared = 0;
};

std::vector<int> best_of_totals(const match_probe_row &row) {
    std::vector<uint8_t> left(row.plane_bytes), right(row.plane_bytes);
    match_probe_path_costs(&row, false, left.data());
    match_probe_path_costs(&row, true, right.data());
    std::vector<int> best;
    for (int x = 0; x < row.width; x++) {
        const match_probe_window window = match_probe_window_at(&row, x);
        const int nearest = x - row.disparity_min - window.first;  // right pixel of the first lane
        int lowest = 256, at = -2;
        for (int i = 0; i < window.count; i++) {
            const size_t cell = window.cell + static_cast<size_t>(i);
            const int sum = std::min<int>(row.from_above[cell], 127) +
                            std::min<int>(left[cell], 127) + right[cell];
            if (std::min(sum, 255) < lowest) {
                lowest = std::min(sum, 255);
                at = window.first + i;
            }
        }
        const bool all_inside = nearest < row.width && nearest - window.count + 1 >= 0;
        best.push_back(all_inside ? at : -2);
    }
    return best;
}

void look(void *self, const match_probe_row *row) {
    Seen &seen = *static_cast<Seen *>(self);
    const std::lock_guard<std::mutex> lock(seen.mutex);
    seen.times[{row->event, row->level, row->y}]++;
    seen.heights[row->level] = row->height;
    if (row->event == MATCH_PROBE_PATH_COSTS) {
        seen.best[{row->level, row->y}] = best_of_totals(*row);
    } else if (row->event == MATCH_PROBE_WINNERS) {
        const std::vector<int> &best = seen.best[{row->level, row->y}];
        for (int x = 0; x < row->width; x++) {
            const int expected = best[static_cast<size_t>(x)];
            seen.compared += expected != -2;
            seen.differing += expected != -2 && expected != row->winner[x];
        }
    }
}

void check_run(match_options options, int threads, const Matched &plain) {
    Seen seen;
    const match_probe probe = match_probe_of(options.kernels, look, &seen);
    options.kernels = &probe.kernels;
    Threads workers(threads);
    MatchSetting setting;
    setting.parallel = workers.parallel();
    const Matched probed = run_match(pair_of_test(), options, setting);
    REQUIRE(probed.status == ERROR_OK);
    CHECK(probed.disparity_q8 == plain.disparity_q8);
    CHECK(probed.reason == plain.reason);
    CHECK(probed.confidence == plain.confidence);
    int rows = 0;
    for (const auto &[level, count] : seen.heights) {
        rows += count;
    }
    // A coarser level's last rows may not be needed.
    CHECK(seen.times.size() <= static_cast<size_t>(3 * rows));
    for (const int event : {MATCH_PROBE_COSTS, MATCH_PROBE_PATH_COSTS, MATCH_PROBE_WINNERS}) {
        for (int y = 0; y < seen.heights[0]; y++) {
            CHECK(seen.times[{event, 0, y}] == 1);
        }
    }
    for (const auto &[key, times] : seen.times) {
        CHECK(times == 1);
    }
    CHECK(seen.compared > rows);
    CHECK(seen.differing == 0);
}

}  // namespace

TEST_CASE("a tap shows what was chosen from and changes nothing") {
    for (const match_preset preset :
         {MATCH_PRESET_FAST, MATCH_PRESET_STANDARD, MATCH_PRESET_BEST, MATCH_PRESET_BOARD}) {
        match_options options = match_default_options(disparity_min, disparity_count);
        options.preset = preset;
        const Matched plain = run_match(pair_of_test(), options);
        REQUIRE(plain.status == ERROR_OK);
        for (const char *name : {"", "plain", "sse41", "avx2", "neon"}) {
            options.kernels = match_kernels_named(name);
            if (options.kernels == nullptr && *name != '\0') {
                continue;  // not on this processor
            }
            for (const int threads : {1, 2, 3}) {
                CAPTURE(match_preset_name(preset));
                CAPTURE(std::string(name));
                CAPTURE(threads);
                check_run(options, threads, plain);
            }
        }
    }
}

// SPDX-License-Identifier: Apache-2.0
#include "tools/host/debug/debug_look.hpp"

#include <algorithm>
#include <bitset>
#include <new>

#include "core/invariant.h"

namespace {

/// Path costs beyond this are clipped to it in the total: two of three must fit a byte.
constexpr int summand_max = 127;

}  // namespace

debug_look::debug_look(int row) : row_(row), probe_(match_probe_of(nullptr, look, this)) {}

void debug_look::look(void *self, const match_probe_row *row) {
    debug_look &looker = *static_cast<debug_look *>(self);
    const std::lock_guard<std::mutex> lock(looker.mutex_);
    // The matcher is C: must not throw.
    try {
        if (!looker.failed_) {
            looker.save(*row);
        }
    } catch (const std::bad_alloc &) {
        looker.failed_ = true;
    }
}

void debug_look::save(const match_probe_row &row) {
    switch (row.event) {
        case MATCH_PROBE_COSTS:
            save_costs(row);
            break;
        case MATCH_PROBE_PATH_COSTS:
            save_path_costs(row);
            break;
        case MATCH_PROBE_WINNERS:
            save_winners(row);
            break;
    }
}

debug_level &debug_look::level_of(const match_probe_row &row) {
    const auto number = static_cast<std::size_t>(row.level);
    if (levels_.size() <= number) {
        levels_.resize(number + 1);
    }
    debug_level &level = levels_[number];
    if (level.width == 0) {
        const std::size_t pixels =
            static_cast<std::size_t>(row.width) * static_cast<std::size_t>(row.height);
        level.winner.assign(pixels, DEBUG_UNSEEN);
        level.cost.resize(pixels);
        level.margin.resize(pixels);
        level.consistent.resize(pixels);
        level.fits.resize(pixels);
        level.window_first.resize(pixels);
        level.window_count.resize(pixels);
        if (row.level == 0) {
            brighter_.resize(pixels);
            gradient_.resize(pixels);
            reason_.resize(pixels);
            slices_.fill(std::vector<std::int16_t>(
                static_cast<std::size_t>(row.width) * static_cast<std::size_t>(row.disparity_count),
                DEBUG_NOT_SEARCHED));
        }
        level.height = row.height;
        level.shift_x = row.shift_x;
        level.shift_y = row.shift_y;
        level.disparity_min = row.disparity_min;
        level.disparity_count = row.disparity_count;
        level.width = row.width;
    }
    INVARIANT(level.width == row.width && level.height == row.height);
    return level;
}

bool debug_look::is_sliced(const match_probe_row &row) const {
    return row.level == 0 && row.y == std::min(row_ >> row.shift_y, row.height - 1);
}

void debug_look::save_slice(const match_probe_row &row, debug_plane plane,
                            const std::uint8_t *bytes) {
    std::vector<std::int16_t> &slice = slices_[plane];
    for (int x = 0; x < row.width; x++) {
        const match_probe_window window = match_probe_window_at(&row, x);
        const int end = std::min(window.first + window.count, row.disparity_count);
        for (int i = window.first; i < end; i++) {
            slice[static_cast<std::size_t>(i) * static_cast<std::size_t>(row.width) +
                  static_cast<std::size_t>(x)] =
                bytes[window.cell + static_cast<std::size_t>(i - window.first)];
        }
    }
}

void debug_look::save_costs(const match_probe_row &row) {
    const debug_level &level = level_of(row);
    if (row.level > 0) {
        return;
    }
    for (int x = 0; x < row.width; x++) {
        std::size_t brighter = 0;
        for (const std::uint8_t *census : row.census) {
            brighter += std::bitset<8>(census[x]).count();
        }
        brighter_[level.index(x, row.y)] = static_cast<std::uint8_t>(brighter);
    }
    std::copy_n(row.gradient, row.width, &gradient_[level.index(0, row.y)]);
    if (is_sliced(row)) {
        save_slice(row, DEBUG_COST, row.cost);
        save_slice(row, DEBUG_COST_ALONG, row.cost_along);
    }
}

void debug_look::save_path_costs(const match_probe_row &row) {
    debug_level &level = level_of(row);
    for (int x = 0; x < row.width; x++) {
        const match_probe_window window = match_probe_window_at(&row, x);
        level.window_first[level.index(x, row.y)] = static_cast<std::int16_t>(window.first);
        level.window_count[level.index(x, row.y)] = static_cast<std::int16_t>(window.count);
    }
    if (!is_sliced(row)) {
        return;
    }
    std::vector<std::uint8_t> left(row.plane_bytes), right(row.plane_bytes), total(row.plane_bytes);
    match_probe_path_costs(&row, false, left.data());
    match_probe_path_costs(&row, true, right.data());
    for (int x = 0; x < row.width; x++) {
        const match_probe_window window = match_probe_window_at(&row, x);
        for (int i = 0; i < window.count; i++) {
            const std::size_t cell = window.cell + static_cast<std::size_t>(i);
            const int sum = std::min<int>(row.from_above[cell], summand_max) +
                            std::min<int>(left[cell], summand_max) + right[cell];
            total[cell] = static_cast<std::uint8_t>(std::min(sum, UINT8_MAX));
        }
    }
    save_slice(row, DEBUG_COST_AROUND, row.cost_around);
    save_slice(row, DEBUG_FROM_ABOVE, row.from_above);
    save_slice(row, DEBUG_FROM_LEFT, left.data());
    save_slice(row, DEBUG_FROM_RIGHT, right.data());
    save_slice(row, DEBUG_TOTAL, total.data());
}

void debug_look::save_winners(const match_probe_row &row) {
    debug_level &level = level_of(row);
    const std::size_t begin = level.index(0, row.y);
    std::copy_n(row.winner, row.width, &level.winner[begin]);
    std::copy_n(row.margin, row.width, &level.margin[begin]);
    std::copy_n(row.consistent, row.width, &level.consistent[begin]);
    std::copy_n(row.fits, row.width, &level.fits[begin]);
    for (int x = 0; x < row.width; x++) {
        // Unknown around a pixel without a winner.
        const std::uint32_t around = row.winner[x] < 0 ? 0 : row.around[x];
        level.cost[begin + static_cast<std::size_t>(x)] =
            static_cast<std::uint8_t>(around >> 8 & 0xff);
    }
    if (row.reason != nullptr) {
        std::copy_n(row.reason, row.width, &reason_[begin]);
    }
}

// SPDX-License-Identifier: Apache-2.0
/// What --debug records of the matcher while it works, kept until the pictures are drawn.
#ifndef VERGENCE_TOOLS_HOST_DEBUG_DEBUG_LOOK_HPP
#define VERGENCE_TOOLS_HOST_DEBUG_DEBUG_LOOK_HPP

#include <array>
#include <cstdint>
#include <mutex>
#include <vector>

#include "stereo/match/probe.h"

/// The byte planes of which one row is kept.
enum debug_plane {
    DEBUG_COST,
    DEBUG_COST_ALONG,
    DEBUG_COST_AROUND,
    DEBUG_FROM_ABOVE,
    DEBUG_FROM_LEFT,
    DEBUG_FROM_RIGHT,
    DEBUG_TOTAL,  // sum of the path costs from which the winners are chosen
    DEBUG_PLANES
};

enum {
    DEBUG_UNSEEN = -2,        // a winner of a row that was never processed
    DEBUG_NOT_SEARCHED = -1,  // a byte of a slice outside the window
};

/// One level: images of its size, one row after the other.
struct debug_level {
    int width = 0, height = 0, shift_x = 0, shift_y = 0;
    int disparity_min = 0, disparity_count = 0;
    std::vector<std::int16_t> winner;  // counted from disparity_min; -1: none; or DEBUG_UNSEEN
    std::vector<std::uint8_t> cost;    // cost of the winner
    std::vector<std::uint8_t> margin, consistent, fits;
    std::vector<std::int16_t> window_first, window_count;

    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x);
    }
};

/// Records one run of the matcher, from any number of threads.
class debug_look {
  public:
    /// `row`: of the full-size left image; slices are from the corresponding row of the level.
    explicit debug_look(int row);
    debug_look(const debug_look &) = delete;
    debug_look &operator=(const debug_look &) = delete;

    /// For match_options.kernels; lives as long as this object.
    const match_kernels *kernels() const { return &probe_.kernels; }

    int row() const { return row_; }
    /// Whether memory ran out; everything else is then undefined.
    bool failed() const { return failed_; }
    /// The finest level first; empty when the preset has no levels.
    const std::vector<debug_level> &levels() const { return levels_; }
    /// Of the finest level: how many of a pixel's 24 neighbours are brighter; 128 + gradient.
    const std::vector<std::uint8_t> &brighter() const { return brighter_; }
    const std::vector<std::uint8_t> &gradient() const { return gradient_; }
    /// Of the finest level: enum reason before the speckle filter.
    const std::vector<std::uint8_t> &reason() const { return reason_; }
    /// One row of the finest level: disparity i of column x at i * width + x, DEBUG_NOT_SEARCHED or
    /// 0..255.
    const std::vector<std::int16_t> &slice(debug_plane plane) const { return slices_[plane]; }

  private:
    static void look(void *self, const match_probe_row *row);
    void save(const match_probe_row &row);
    void save_costs(const match_probe_row &row);
    void save_path_costs(const match_probe_row &row);
    void save_winners(const match_probe_row &row);
    void save_slice(const match_probe_row &row, debug_plane plane, const std::uint8_t *bytes);
    debug_level &level_of(const match_probe_row &row);
    bool is_sliced(const match_probe_row &row) const;

    int row_;
    bool failed_ = false;
    std::mutex mutex_;
    match_probe probe_;
    std::vector<debug_level> levels_;
    std::vector<std::uint8_t> brighter_, gradient_, reason_;
    std::array<std::vector<std::int16_t>, DEBUG_PLANES> slices_;
};

#endif

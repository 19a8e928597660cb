// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate_mirror.hpp"

#include <algorithm>

namespace {

/// The view in a mirror, numbered clockwise again: rows or columns run the other way.
calib::board_view mirrored(const calib::board &board, const calib::board_view &view, int width_px,
                           bool by_rows) {
    calib::board_view made = view;
    for (calib::corner &corner : made.corners) {
        int row = corner.index / board.columns, column = corner.index % board.columns;
        (by_rows ? row : column) = by_rows ? board.rows - 1 - row : board.columns - 1 - column;
        corner.index = row * board.columns + column;
        corner.x_px = width_px - 1 - corner.x_px;
    }
    std::sort(made.corners.begin(), made.corners.end(),
              [](const calib::corner &a, const calib::corner &b) { return a.index < b.index; });
    return made;
}

}  // namespace

bool calibrate_one_camera_mirrors(const calib::observations &seen, int threads, int pairs_used) {
    if (seen.cameras != 2 || seen.target.coded()) {
        return false;
    }
    calib::solve_options options;
    options.threads = threads;
    options.choose_model = false;
    options.second_start = false;
    for (const bool by_rows : {true, false}) {
        calib::observations other = seen;
        int pairs = 0;
        for (calib::sighting &sighting : other.sightings) {
            calib::board_view &right = sighting.view[1];
            right = mirrored(seen.target, right, seen.width_px[1], by_rows);
            pairs += !right.corners.empty() && !sighting.view[0].corners.empty();
        }
        const calib::solution found = calib::solve(other, options);
        if (found.solved && found.pairs_used > std::max(pairs_used, pairs / 2)) {
            return true;
        }
    }
    return false;
}

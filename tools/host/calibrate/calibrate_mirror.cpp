// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_mirror.hpp"

#include <algorithm>
#include <iterator>

namespace {

/// The mirrored view, numbered clockwise again: rows or columns run the other way.
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

// Enough to decide, and solved quickly.
const size_t pairs_tried = 12;
const double much_better = 3;  // in residuals
const double poor_rms_px = 1;  // from here on something may be wrong with all pictures

bool is_pair(const calib::capture &capture) {
    return !capture.view[0].corners.empty() && !capture.view[1].corners.empty();
}

int count_pairs(const calib::observations &seen) {
    return static_cast<int>(std::count_if(seen.captures.begin(), seen.captures.end(), is_pair));
}

/// Up to `pairs_tried` of the pairs, spread from the first to the last.
calib::observations some_pairs(const calib::observations &seen) {
    std::vector<calib::capture> pairs;
    std::copy_if(seen.captures.begin(), seen.captures.end(), std::back_inserter(pairs), is_pair);
    const size_t count = std::min(pairs.size(), pairs_tried);
    calib::observations some = seen;
    some.captures.clear();
    for (size_t i = 0; i < count; i++) {
        some.captures.push_back(pairs[i * pairs.size() / count]);
    }
    return some;
}

calib::solve_options quick_options(int threads, const std::function<void(const char *)> &progress) {
    calib::solve_options options;
    options.threads = threads;
    options.choose_model = false;
    options.second_start = false;
    options.progress = progress;
    return options;
}

}  // namespace

bool calibrate_pairs_fit(const calib::solution &found, int pairs) {
    return found.solved && 2 * found.pairs_used >= pairs && found.rms_px < poor_rms_px;
}

bool calibrate_one_camera_mirrors(const calib::observations &seen, int threads,
                                  const calib::solution &as_they_are,
                                  const std::function<void(const char *)> &progress) {
    if (seen.cameras != 2 || seen.target.coded()) {
        return false;
    }
    const calib::observations some = some_pairs(seen);
    const auto tried = static_cast<double>(some.captures.size());
    const double fitted = as_they_are.pairs_used / std::max(1.0, double(count_pairs(seen)));
    for (const bool by_rows : {true, false}) {
        calib::observations other = some;
        for (calib::capture &capture : other.captures) {
            calib::board_view &right = capture.view[1];
            right = mirrored(seen.target, right, seen.width_px[1], by_rows);
        }
        const calib::solution found = calib::solve(other, quick_options(threads, progress));
        // The solver may also have accepted wrong pairs as noise and kept them.
        const bool better = much_better * found.rms_px < as_they_are.rms_px;
        if (found.solved && found.pairs_used > tried * (better ? 0.5 : std::max(fitted, 0.5))) {
            return true;
        }
    }
    return false;
}

bool calibrate_one_camera_mirrors_at_a_glance(const calib::observations &seen, int threads,
                                              const std::function<void(const char *)> &progress) {
    if (seen.cameras != 2 || seen.target.coded() || count_pairs(seen) <= 2 * int(pairs_tried)) {
        return false;
    }
    const calib::observations some = some_pairs(seen);
    const calib::solution found = calib::solve(some, quick_options(threads, progress));
    return !calibrate_pairs_fit(found, static_cast<int>(pairs_tried)) &&
           calibrate_one_camera_mirrors(some, threads, found, progress);
}

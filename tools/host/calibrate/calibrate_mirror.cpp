// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_mirror.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "stereo/geometry/lens.h"

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

const size_t pairs_tried = 12;       // enough to decide, and solved quickly
const int fewest_pairs = 4;          // fewer fit anything
const double poor_rms_px = 1;        // an RMS above this may mean an error common to all pictures
const double place_squares = 0.25;   // largest distance from the expected corner, in squares
const double most = 0.6, few = 0.5;  // shares of pairs of one rig: a camera mirrors, or does not

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

/// What one camera saw, as the only one.
calib::observations alone(const calib::observations &seen, size_t camera) {
    calib::observations one = seen;
    one.cameras = 1;
    one.width_px[0] = seen.width_px[camera];
    one.height_px[0] = seen.height_px[camera];
    for (calib::capture &capture : one.captures) {
        std::swap(capture.view[0], capture.view[camera]);
        capture.view[1] = {};
    }
    return one;
}

/// A camera without the other one: its lens, and where it saw each board.
struct one_camera {
    calib::observations seen;
    calib::solution found;

    bool fits() const {
        return found.solved && found.rms_px < poor_rms_px &&
               found.captures_used >= few * double(seen.captures.size());
    }
};

/// Median distance, in squares, of a view's corners from where a pose of the board puts them.
double off_squares(const one_camera &camera, const calib::board_view &view,
                   const calib::rigid &T_camera_board, const calib::board &board) {
    std::vector<double> off;
    for (const calib::corner &corner : view.corners) {
        const double on_board_mm[3] = {corner.index % board.columns * board.square_mm,
                                       corner.index / board.columns * board.square_mm, 0};
        double point_mm[3], pixel_px[2];
        calib::apply(T_camera_board, on_board_mm, point_mm);
        const struct lens &lens = camera.found.camera[0];
        const double square_px = lens.fx_px * board.square_mm / std::max(point_mm[2], 1e-9);
        off.push_back(point_mm[2] > 0 && lens_project(&lens, point_mm, pixel_px)
                          ? std::hypot(pixel_px[0] - corner.x_px, pixel_px[1] - corner.y_px) /
                                square_px
                          : HUGE_VAL);
    }
    std::nth_element(off.begin(), off.begin() + long(off.size() / 2), off.end());
    return off[off.size() / 2];
}

/// The largest share of the pairs that one pose of the right camera explains, taken from each pair
/// in turn: the two cameras alone say where the board is, so that this needs no solution of both.
double share_explained(const one_camera &left, const one_camera &right, const calib::board &board) {
    const size_t count = left.seen.captures.size();
    int best = 0;
    for (size_t from = 0; from < count; from++) {
        if (!left.found.board_known[from] || !right.found.board_known[from]) {
            continue;
        }
        const calib::rigid T_right_left =
            right.found.T_left_board[from] * calib::inverse(left.found.T_left_board[from]);
        int explained = 0;
        for (size_t i = 0; i < count; i++) {
            explained +=
                left.found.board_known[i] &&
                off_squares(right, right.seen.captures[i].view[0],
                            T_right_left * left.found.T_left_board[i], board) < place_squares;
        }
        best = std::max(best, explained);
    }
    return double(best) / double(std::max<size_t>(count, 1));
}

}  // namespace

bool calibrate_pairs_fit(const calib::solution &found, int pairs) {
    return found.solved && 2 * found.pairs_used >= pairs && found.rms_px < poor_rms_px;
}

calibrate_pair_fault calibrate_find_pair_fault(const calib::observations &seen, int threads,
                                               const std::function<void(const char *)> &progress) {
    if (seen.cameras != 2 || count_pairs(seen) < fewest_pairs) {
        return calibrate_pair_fault::none;
    }
    const calib::observations some = some_pairs(seen);
    const calib::solve_options options = quick_options(threads, progress);
    const auto solve_alone = [&](const calib::observations &both, size_t camera) {
        one_camera one{alone(both, camera), {}};
        one.found = calib::solve(one.seen, options);
        return one;
    };
    const one_camera left = solve_alone(some, 0), right = solve_alone(some, 1);
    if (!left.fits() || !right.fits()) {
        return calibrate_pair_fault::none;
    }
    if (share_explained(left, right, seen.target) >= few) {
        return calibrate_pair_fault::none;
    }
    for (const bool by_rows : {true, false}) {
        if (seen.target.coded()) {
            break;
        }
        calib::observations other = some;
        for (calib::capture &capture : other.captures) {
            capture.view[1] = mirrored(seen.target, capture.view[1], seen.width_px[1], by_rows);
        }
        const one_camera back = solve_alone(other, 1);
        if (back.fits() && share_explained(left, back, seen.target) >= most) {
            return calibrate_pair_fault::one_mirrors;
        }
    }
    return calibrate_pair_fault::apart;
}

bool calibrate_one_camera_mirrors_at_a_glance(const calib::observations &seen, int threads,
                                              const std::function<void(const char *)> &progress) {
    if (seen.cameras != 2 || seen.target.coded() || count_pairs(seen) <= 2 * int(pairs_tried)) {
        return false;
    }
    const calib::observations some = some_pairs(seen);
    const calib::solution found = calib::solve(some, quick_options(threads, progress));
    return !calibrate_pairs_fit(found, static_cast<int>(pairs_tried)) &&
           calibrate_find_pair_fault(some, threads, progress) == calibrate_pair_fault::one_mirrors;
}

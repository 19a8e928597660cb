// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "calib/base/coded_layout.hpp"
#include "calib/detect/detect_exposure.hpp"
#include "calib/detect/detect_extent.hpp"
#include "calib/detect/detect_order.hpp"
#include "calib/detect/detect_rejection.hpp"

namespace calib {

namespace {

using namespace detect;

// Corners closer together than this are measured on the next larger level.
constexpr double square_on_levels_px = 8, smallest_square_px = 4.5;
constexpr int shortest_side_px = 16;
constexpr double min_share = 0.9;  // share of a plain board's corners that must be measured
constexpr int fewest_coded_corners = 6;
constexpr int fewest_corners_beyond = 2;  // corners beyond the ends of a layout that exclude it

struct search {
    const calib::board &board;
    const std::vector<plane> &levels;
    near_miss nearest;
    grid nearest_grid;
    int nearest_level = 0;
    board_view best;     // the view with the most corners on all levels so far
    int max_boards = 0;  // whole plain boards found on one level

    double clear_share() const {
        return board.coded() ? (1 - board.marker_mm / board.square_mm) / 2 : 1;
    }
    void remember(const near_miss &miss, int level, const grid &found) {
        if (miss.corners > nearest.corners || (miss.mirrored && !nearest.mirrored)) {
            nearest = miss;
            nearest_grid = found;
            nearest_level = level;
        }
    }
};

int min_corners(const board &board) {
    return static_cast<int>(min_share * board.corner_count() + 0.999);
}

// A grid with this many corners is too large to be the board, however many of them are false.
size_t too_many_corners(const board &board) {
    return 2 * static_cast<size_t>(board.corner_count()) + 64;
}

// The plain boards among the grids of one level; the one with the most corners becomes the best.
void plain_boards(search *state, int level, const std::vector<grid> &grids) {
    const int min = min_corners(state->board);
    int boards = 0;
    for (const grid &found : grids) {
        near_miss miss = near_miss_of(state->levels[static_cast<size_t>(level)], found);
        board_view view;
        if (has_size_of(state->board, found) && miss.corners >= min) {
            const refined_grid refined =
                refine_corners(state->levels, level, found, state->clear_share());
            miss.continued = squares_continue(state->levels[0], found, refined);
            if (!miss.continued && outer_lines_measured(found, refined) &&
                !too_blurred(refined.blur_px, refined.spacing_px)) {
                view = plain_view(state->board, found, refined);
                miss.corners = static_cast<int>(view.corners.size());
            }
        }
        if (static_cast<int>(view.corners.size()) < min) {
            state->remember(miss, level, found);
            continue;
        }
        boards++;
        if (view.corners.size() > state->best.corners.size()) {
            state->best = view;
        }
    }
    state->max_boards = std::max(state->max_boards, boards);
}

void merge(const board_view &part, board_view *whole) {
    for (const corner &next : part.corners) {
        const auto at =
            std::lower_bound(whole->corners.begin(), whole->corners.end(), next.index,
                             [](const corner &known, int index) { return known.index < index; });
        if (at == whole->corners.end() || at->index != next.index) {
            whole->corners.insert(at, next);
        }
    }
}

struct coded_part {
    const grid *found;
    refined_grid corners;
    board_place place;
};

// The view of all parts of a board. Where the markers fit both layouts, the right one has the
// corners that were found within its ends.
board_view joined(const board &board, std::vector<coded_part> parts) {
    board_view view;
    if (layouts_differ_by_column(board)) {
        int lead = 0;  // corners beyond the ends of black first minus those of white first
        for (coded_part &part : parts) {
            lead += corners_beyond(board, *part.found, part.corners, part.place);
            part.place.column--;
            lead -= corners_beyond(board, *part.found, part.corners, part.place);
        }
        view.layout_open = std::abs(lead) < fewest_corners_beyond;
        view.white_first = !view.layout_open && lead > 0;
        for (coded_part &part : parts) {
            part.place.column += view.white_first ? 0 : 1;
        }
    }
    for (const coded_part &part : parts) {
        merge(coded_view(board, *part.found, part.corners, part.place), &view);
        view.white_first = view.white_first || part.place.white_first;
    }
    return view;
}

// What one level shows of a coded board: all parts with readable markers.
void coded_parts(search *state, int level, const std::vector<grid> &grids) {
    std::vector<coded_part> parts;
    for (const grid &found : grids) {
        near_miss miss = near_miss_of(state->levels[static_cast<size_t>(level)], found);
        refined_grid corners = as_found(level, found);
        const marker_reading reading = read_markers(state->board, state->levels, found, corners);
        miss.markers_seen = reading.seen;
        miss.markers_known = reading.known;
        miss.mirrored = reading.placed && reading.place.mirrored;
        if (reading.placed && !miss.mirrored) {
            corners = refine_corners(state->levels, level, found, state->clear_share());
            if (!too_blurred(corners.blur_px, corners.spacing_px)) {
                parts.push_back({&found, std::move(corners), reading.place});
                continue;
            }
        }
        state->remember(miss, level, found);
    }
    const board_view view = joined(state->board, std::move(parts));
    if (view.corners.size() > state->best.corners.size()) {
        state->best = view;
    }
}

// Searches `planes`, the levels or smoothed ones, until all corners are found. A large board is
// found on a small level, which is fast.
void look(search *state, const std::vector<plane> &planes, const detect_options &options) {
    for (int level = static_cast<int>(planes.size()) - 1; level >= 0; level--) {
        if (static_cast<int>(state->best.corners.size()) == state->board.corner_count()) {
            return;
        }
        const plane &pixels = planes[static_cast<size_t>(level)];
        const std::vector<saddle> saddles =
            saddles_of(pixels, static_cast<size_t>(std::max(0, options.max_candidates)));
        grid_limits limits;
        limits.nearest_px = level == 0 ? smallest_square_px : square_on_levels_px;
        limits.whole_lines = !state->board.coded();
        limits.enough = too_many_corners(state->board);
        const std::vector<grid> grids = grids_of(pixels, saddles, limits);
        if (state->board.coded()) {
            coded_parts(state, level, grids);
        } else {
            plain_boards(state, level, grids);
        }
    }
}

// Why no board was found, from the best candidate grid.
std::string reason(search *state) {
    const size_t corners = static_cast<size_t>(state->nearest_grid.found_count());
    if (corners > 0 && corners < too_many_corners(state->board)) {
        const refined_grid refined = refine_corners(state->levels, state->nearest_level,
                                                    state->nearest_grid, state->clear_share());
        state->nearest.blur_px = refined.blur_px;
        state->nearest.spacing_px = refined.spacing_px;
    }
    return rejection_of(state->board, state->levels, state->nearest);
}

board_view refused(std::string why) {
    board_view view;
    view.rejection = std::move(why);
    return view;
}

}  // namespace

board_view detect_board(const board &board, const image_u8 &image, const detect_options &options) {
    if (std::min(image.width, image.height) < shortest_side_px) {
        return refused("no board found: the image is too small to show one");
    }
    const std::vector<plane> levels = pyramid_of(image);
    search state = {board, levels, {}, {}, 0, {}, 0};
    const int min = board.coded() ? fewest_coded_corners : min_corners(board);
    const auto found_enough = [&] { return static_cast<int>(state.best.corners.size()) >= min; };
    look(&state, levels, options);
    // A second look, smoothed more and more, for boards in noise, halos or low light. It takes
    // longer than the first.
    constexpr int filters_each_time[] = {1, 4};
    std::vector<plane> smooth;
    for (const int times : filters_each_time) {
        if (found_enough()) {
            break;
        }
        smooth = smoothed(smooth.empty() ? levels : smooth, times);
        look(&state, smooth, options);
    }
    if (state.max_boards > 1) {
        return refused("two boards of this size are in view");
    }
    if (!found_enough()) {
        return refused(reason(&state));
    }
    state.best.clipped = clipped_share(board, state.clear_share(), image, state.best);
    return state.best;
}

}  // namespace calib

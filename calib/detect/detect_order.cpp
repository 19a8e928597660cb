// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_order.hpp"

#include <algorithm>

#include "core/invariant.h"

namespace calib::detect {

namespace {

// Preferred row direction in the image where the board is ambiguous: to the right and slightly
// down, so that boards held upright or on their side are far from the switch-over.
constexpr direction preferred = {0.894, 0.447};

// The corner of the original grid that became corner (column, row) of the turned grid.
size_t node_before(const grid &found, int quarters, int column, int row) {
    int columns = quarters % 2 == 0 ? found.columns : found.rows;
    int rows = quarters % 2 == 0 ? found.rows : found.columns;
    for (int turn = 0; turn < quarters; turn++) {
        // One turn back: see grid::turned.
        const int old_column = rows - 1 - row;
        row = column;
        column = old_column;
        std::swap(columns, rows);
    }
    return static_cast<size_t>(row * columns + column);
}

// Mean direction of the rows after `quarters` turns, not normalised.
direction row_direction(const grid &found, const refined_grid &refined, int quarters) {
    direction sum;
    const int columns = quarters % 2 == 0 ? found.columns : found.rows;
    const int rows = quarters % 2 == 0 ? found.rows : found.columns;
    for (int row = 0; row < rows; row++) {
        const refined_corner &from = refined.corners[node_before(found, quarters, 0, row)];
        const refined_corner &to = refined.corners[node_before(found, quarters, columns - 1, row)];
        if (from.found && to.found) {
            sum.x += to.x - from.x;
            sum.y += to.y - from.y;
        }
    }
    return sum;
}

// Calls `use` with each measured corner's column and row on the board, row by row.
template <typename F>
void for_corners_at(const grid &found, const refined_grid &refined, const board_place &place,
                    const F &use) {
    INVARIANT(place.quarters >= 0 && place.quarters < 4);
    INVARIANT(refined.corners.size() == found.nodes.size());
    const int columns = place.quarters % 2 == 0 ? found.columns : found.rows;
    const int rows = place.quarters % 2 == 0 ? found.rows : found.columns;
    for (int row = 0; row < rows; row++) {
        for (int column = 0; column < columns; column++) {
            const refined_corner &corner =
                refined.corners[node_before(found, place.quarters, column, row)];
            if (corner.found) {
                use(column + place.column, row + place.row, corner);
            }
        }
    }
}

}  // namespace

bool has_size_of(const board &board, const grid &found) {
    return (found.columns == board.columns && found.rows == board.rows) ||
           (found.columns == board.rows && found.rows == board.columns);
}

board_view plain_view(const board &board, const grid &found, const refined_grid &refined) {
    board_view view;
    int best = -1;
    double best_score = 0;
    const bool colours_differ = (board.columns + board.rows) % 2 != 0 ||
                                (board.columns == board.rows && board.columns % 2 != 0);
    for (int quarters = 0; quarters < 4; quarters++) {
        const grid turned = found.turned(quarters);
        if (turned.columns != board.columns || turned.rows != board.rows ||
            (colours_differ && turned.light_square(-1, -1))) {
            continue;
        }
        const direction rows_run = row_direction(found, refined, quarters);
        const double score = preferred.x * rows_run.x + preferred.y * rows_run.y;
        if (best < 0 || score > best_score) {
            best = quarters;
            best_score = score;
        }
    }
    for (int index = 0; best >= 0 && index < board.corner_count(); index++) {
        const refined_corner &corner =
            refined.corners[node_before(found, best, index % board.columns, index / board.columns)];
        if (corner.found) {
            view.corners.push_back({index, corner.x, corner.y, corner.sigma_px});
        }
    }
    return view;
}

board_view coded_view(const board &board, const grid &found, const refined_grid &refined,
                      const board_place &place) {
    board_view view;
    for_corners_at(found, refined, place, [&](int column, int row, const refined_corner &corner) {
        if (column >= 0 && row >= 0 && column < board.columns && row < board.rows) {
            view.corners.push_back(
                {row * board.columns + column, corner.x, corner.y, corner.sigma_px});
        }
    });
    return view;
}

int corners_beyond(const board &board, const grid &found, const refined_grid &refined,
                   const board_place &place) {
    int beyond = 0;
    for_corners_at(found, refined, place, [&](int column, int row, const refined_corner &) {
        const bool next_column = column == -1 || column == board.columns;
        beyond += next_column && row >= 0 && row < board.rows;
    });
    return beyond;
}

}  // namespace calib::detect

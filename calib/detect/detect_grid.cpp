// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_grid.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "calib/detect/detect_links.hpp"
#include "core/invariant.h"

namespace calib::detect {

namespace {

constexpr int fewest_corners = 4;
constexpr size_t max_grids = 8;
constexpr int max_tries = 2000;    // growth steps on one level: some tenths of a second
constexpr size_t max_pieces = 16;  // grids that are grown: growing takes time

// The neighbour in direction `d`.
place beside(const place &from, int d) {
    constexpr int columns[4] = {1, 0, -1, 0}, rows[4] = {0, 1, 0, -1};
    return {from.row + rows[d], from.column + columns[d]};
}

// Whether a step from `from` in direction `d` to `to` continues the preceding line: same direction,
// and a length that perspective can explain.
bool continues_line(const loose_grid &cells, const place &from, int d, const saddle &to) {
    const auto before = cells.find(beside(from, (d + 2) % 4));
    if (before == cells.end()) {
        return true;
    }
    const saddle &a = before->second.at, &b = cells.at(from).at;
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    return std::hypot(to.x - 2 * b.x + a.x, to.y - 2 * b.y + a.y) < 0.5 * length;
}

// Numbers all saddles that links reach from `seed`; `taken` marks them.
loose_grid connected(const std::vector<saddle> &saddles, const std::vector<saddle_links> &links,
                     size_t seed, std::vector<bool> *taken) {
    loose_grid cells;
    std::deque<std::pair<size_t, place>> open;
    INVARIANT(seed < saddles.size() && links.size() == saddles.size());
    INVARIANT(taken->size() == saddles.size());
    const auto put = [&](size_t index, const place &where, int turn) {
        (*taken)[index] = true;
        cells[where] = node{true, saddles[index], turn};
        open.emplace_back(index, where);
    };
    put(seed, {0, 0}, 0);
    while (!open.empty()) {
        const auto [index, where] = open.front();
        open.pop_front();
        const int turn = cells[where].turn;
        for (int ray = 0; ray < 4; ray++) {
            const link &edge = links[index][static_cast<size_t>(ray)];
            if (edge.to < 0 || (*taken)[static_cast<size_t>(edge.to)]) {
                continue;
            }
            const int d = (ray + turn) % 4;
            const place next = beside(where, d);
            const saddle &to = saddles[static_cast<size_t>(edge.to)];
            if (cells.count(next) == 0 && continues_line(cells, where, d, to)) {
                put(static_cast<size_t>(edge.to), next, (d + 2 - edge.ray + 4) % 4);
            }
        }
    }
    return cells;
}

grid dense(const loose_grid &cells) {
    grid made;
    if (cells.empty()) {
        return made;
    }
    place min = cells.begin()->first, max = min;
    for (const auto &[where, ignored] : cells) {
        min.row = std::min(min.row, where.row);
        min.column = std::min(min.column, where.column);
        max.row = std::max(max.row, where.row);
        max.column = std::max(max.column, where.column);
    }
    made.columns = max.column - min.column + 1;
    made.rows = max.row - min.row + 1;
    made.nodes.resize(static_cast<size_t>(made.columns) * static_cast<size_t>(made.rows));
    for (const auto &[where, cell] : cells) {
        made.at(where.column - min.column, where.row - min.row) = cell;
    }
    INVARIANT(made.found_count() == static_cast<int>(cells.size()));
    return made;
}

bool share_corner(const grid &a, const grid &b) {
    constexpr double same_px = 2;
    for (const node &mine : a.nodes) {
        for (const node &other : b.nodes) {
            if (mine.found && other.found &&
                std::hypot(mine.at.x - other.at.x, mine.at.y - other.at.y) < same_px) {
                return true;
            }
        }
    }
    return false;
}

// Two pieces of one board may both have grown to the whole board.
std::vector<grid> without_repeats(const std::vector<grid> &found) {
    std::vector<grid> kept;
    for (const grid &next : found) {
        const bool repeated = std::any_of(
            kept.begin(), kept.end(), [&](const grid &other) { return share_corner(next, other); });
        if (!repeated && kept.size() < max_grids) {
            kept.push_back(next);
        }
    }
    return kept;
}

}  // namespace

int grid::found_count() const {
    return static_cast<int>(
        std::count_if(nodes.begin(), nodes.end(), [](const node &n) { return n.found; }));
}

bool grid::light_square(int column, int row) const {
    INVARIANT(nodes.size() == static_cast<size_t>(columns * rows));
    for (int r = 0; r < rows; r++) {
        for (int c = 0; c < columns; c++) {
            if (at(c, r).found) {
                // Ray 0 of an even turn is on a row. Light follows it clockwise, and clockwise from
                // +column is +row.
                return (at(c, r).turn + c + r + column + row) % 2 == 0;
            }
        }
    }
    return false;
}

grid grid::turned(int quarters) const {
    INVARIANT(quarters >= 0 && nodes.size() == static_cast<size_t>(columns * rows));
    grid made = *this;
    for (int turn = 0; turn < quarters; turn++) {
        grid next;
        next.columns = made.rows;
        next.rows = made.columns;
        next.nodes.resize(made.nodes.size());
        for (int row = 0; row < made.rows; row++) {
            for (int column = 0; column < made.columns; column++) {
                node moved = made.at(column, row);
                // The former +row direction is now +column.
                moved.turn = (moved.turn + 3) % 4;
                next.at(row, made.columns - 1 - column) = moved;
            }
        }
        made = std::move(next);
    }
    return made;
}

std::vector<grid> grids_of(const plane &level, const std::vector<saddle> &saddles,
                           const grid_limits &limits) {
    INVARIANT(level.pixels.size() ==
              static_cast<size_t>(level.width) * static_cast<size_t>(level.height));
    const std::vector<saddle_links> links = links_of(level, saddles, limits.nearest_px);
    std::vector<bool> taken(saddles.size(), false);
    std::vector<loose_grid> pieces;
    for (size_t seed = 0; seed < saddles.size(); seed++) {
        if (!taken[seed]) {
            loose_grid cells = connected(saddles, links, seed, &taken);
            if (static_cast<int>(cells.size()) >= fewest_corners) {
                pieces.push_back(std::move(cells));
            }
        }
    }
    std::stable_sort(pieces.begin(), pieces.end(),
                     [](const loose_grid &a, const loose_grid &b) { return a.size() > b.size(); });
    pieces.resize(std::min(pieces.size(), max_pieces));
    std::vector<grid> found;
    int tries = max_tries;
    for (loose_grid &cells : pieces) {
        grow(level, limits.enough, &tries, &cells);
        trim(&cells, limits.whole_lines);
        grid made = dense(cells);
        if (made.columns >= 2 && made.rows >= 2 && made.found_count() >= fewest_corners) {
            found.push_back(std::move(made));
        }
    }
    std::stable_sort(found.begin(), found.end(), [](const grid &a, const grid &b) {
        return a.found_count() > b.found_count();
    });
    return without_repeats(found);
}

}  // namespace calib::detect

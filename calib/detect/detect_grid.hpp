// SPDX-License-Identifier: Apache-2.0
/// Grids of saddles: pieces of chessboards, numbered by column and row.
#ifndef VERGENCE_CALIB_DETECT_DETECT_GRID_HPP
#define VERGENCE_CALIB_DETECT_DETECT_GRID_HPP

#include <vector>

#include "calib/detect/detect_grow.hpp"

namespace calib::detect {

/// The row direction is clockwise from the column direction, as on a board seen from its front.
struct grid {
    int columns = 0, rows = 0;
    std::vector<node> nodes;  // row by row

    const node &at(int column, int row) const {
        return nodes[static_cast<size_t>(row) * static_cast<size_t>(columns) +
                     static_cast<size_t>(column)];
    }
    node &at(int column, int row) {
        return const_cast<node &>(static_cast<const grid *>(this)->at(column, row));
    }
    bool has(int column, int row) const {
        return column >= 0 && row >= 0 && column < columns && row < rows && at(column, row).found;
    }
    int found_count() const;
    /// Whether the square between (column, row) and (column + 1, row + 1) is light; colours
    /// alternate over the whole grid.
    bool light_square(int column, int row) const;
    /// The same grid, numbered from another corner: `quarters` quarter turns.
    grid turned(int quarters) const;
};

struct grid_limits {
    double nearest_px = 8;    // smallest distance between two corners
    bool whole_lines = true;  // ignore outer lines of which most is missing
    size_t enough = 1000;     // a grid with this many corners is not grown further
};

/// The grids of 2 x 2 corners or more on a level: up to eight, the ones with most corners first.
/// Gaps are filled and borders extended where the image shows a matching corner.
std::vector<grid> grids_of(const plane &level, const std::vector<saddle> &saddles,
                           const grid_limits &limits);

}  // namespace calib::detect

#endif

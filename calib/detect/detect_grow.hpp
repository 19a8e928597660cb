// SPDX-License-Identifier: Apache-2.0
/// Completes a grid: finds corners that the first search missed, where their neighbours predict
/// them, and removes corners that do not belong.
#ifndef VERGENCE_CALIB_DETECT_DETECT_GROW_HPP
#define VERGENCE_CALIB_DETECT_DETECT_GROW_HPP

#include <map>

#include "calib/detect/detect_saddles.hpp"

namespace calib::detect {

/// A corner of a grid.
struct node {
    bool found = false;
    saddle at;     // saddle point in pixels of the level
    int turn = 0;  // ray k points in grid direction (k + turn) % 4: +column, +row, -column, -row
};

/// A place in a grid whose borders are not known yet.
struct place {
    int row = 0, column = 0;
    bool operator<(const place &other) const {
        return row != other.row ? row < other.row : column < other.column;
    }
};

using loose_grid = std::map<place, node>;

/// Fills gaps and extends the borders, corner by corner, as long as the image agrees and there are
/// fewer than `enough` corners. `*tries` limits the number of places examined and is decremented.
void grow(const plane &level, size_t enough, int *tries, loose_grid *cells);

/// Removes corners attached by a single edge; with `whole_lines` also outer lines of which less
/// than half is present.
void trim(loose_grid *cells, bool whole_lines);

}  // namespace calib::detect

#endif

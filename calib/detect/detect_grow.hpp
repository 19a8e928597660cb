// SPDX-License-Identifier: Apache-2.0
/// Completes a grid: looks for the corners that the first search missed where their neighbours say
/// that they must be, and takes away what does not belong.
#ifndef VERGENCE_CALIB_DETECT_DETECT_GROW_HPP
#define VERGENCE_CALIB_DETECT_DETECT_GROW_HPP

#include <map>

#include "calib/detect/detect_grid.hpp"

namespace calib::detect {

/// A place in a grid whose borders are not known yet.
struct place {
    int row = 0, column = 0;
    bool operator<(const place &other) const {
        return row != other.row ? row < other.row : column < other.column;
    }
};

using loose_grid = std::map<place, node>;

/// Fills gaps and extends the borders, corner by corner, as long as the image agrees and there are
/// fewer than `enough` corners; `*tries` bounds the places that are looked at, and goes down.
void grow(const plane &level, size_t enough, int *tries, loose_grid *cells);

/// Takes away corners that hang on by one edge; with `whole_lines` also outer lines of which less
/// than half is there.
void trim(loose_grid *cells, bool whole_lines);

}  // namespace calib::detect

#endif

// SPDX-License-Identifier: Apache-2.0
/// Which part of a coded board a grid covers, read from the markers in its light squares.
#ifndef VERGENCE_CALIB_DETECT_DETECT_MARKERS_HPP
#define VERGENCE_CALIB_DETECT_DETECT_MARKERS_HPP

#include <vector>

#include "calib/base/board.hpp"
#include "calib/detect/refine_corners.hpp"

namespace calib::detect {

/// Where a grid is on the board: after `quarters` quarter turns (`grid::turned`), its corner (0, 0)
/// is the board's corner (column, row).
struct board_place {
    int quarters = 0, column = 0, row = 0;
    int markers = 0;           // markers that agree
    bool mirrored = false;     // the markers read as in a mirror: nothing else is valid then
    bool white_first = false;  // see board_view
};

struct marker_reading {
    int seen = 0;   // light squares with a marker's black border
    int known = 0;  // seen markers with a dictionary code that this board carries
    bool placed = false;
    board_place place;
};

marker_reading read_markers(const board &board, const std::vector<plane> &levels, const grid &found,
                            const refined_grid &refined);

}  // namespace calib::detect

#endif

// SPDX-License-Identifier: Apache-2.0
/// Coded boards with an odd number of squares in a row and an even number of rows of squares: the
/// layout of OpenCV before 4.6 is the present one, moved by one column. A view that shows neither
/// the first nor the last column of corners fits both; all views together decide.
#ifndef VERGENCE_CALIB_BASE_CODED_LAYOUT_HPP
#define VERGENCE_CALIB_BASE_CODED_LAYOUT_HPP

#include <vector>

#include "calib/base/board.hpp"

namespace calib {

/// Whether the two layouts of this board differ by one column only.
inline bool layouts_differ_by_column(const board &board) {
    return board.coded() && board.columns % 2 == 0 && board.rows % 2 != 0;
}

/// Numbers the corners of all views, which show one board, by one layout: that of most views that
/// show it, else the present one. Views of other boards stay as they are. May be called again with
/// more views.
void settle_layouts(const board &board, const std::vector<board_view *> &views);

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
#include "calib/base/coded_layout.hpp"

#include "core/invariant.h"

namespace calib {

namespace {

// The same corners, numbered by the other layout. A corner beyond its ends was none of the board.
void renumber(const board &board, board_view *view) {
    const int shift = view->white_first ? 1 : -1;
    INVARIANT(layouts_differ_by_column(board));
    std::vector<corner> kept;
    for (corner one : view->corners) {
        const int column = one.index % board.columns + shift;
        if (column >= 0 && column < board.columns) {
            one.index += shift;
            kept.push_back(one);
        }
    }
    view->corners = kept;
    view->white_first = !view->white_first;
    view->layout_open = true;
}

}  // namespace

void settle_layouts(const board &board, const std::vector<board_view *> &views) {
    if (!layouts_differ_by_column(board)) {
        return;
    }
    int lead = 0;  // views with white first minus views with black first
    for (const board_view *view : views) {
        if (!view->corners.empty() && !view->layout_open) {
            lead += view->white_first ? 1 : -1;
        }
    }
    for (board_view *view : views) {
        if (!view->corners.empty() && view->white_first != (lead > 0)) {
            renumber(board, view);
        }
    }
}

}  // namespace calib

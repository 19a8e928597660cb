// SPDX-License-Identifier: Apache-2.0
/// Boards that look the same after a rotation: finds which views must be renumbered so that left
/// and right agree on the corners. All pairs come from one rig, so one epipolar geometry fits them
/// all; a view numbered from the wrong end does not fit it.
#ifndef VERGENCE_CALIB_BASE_PAIR_ORDER_HPP
#define VERGENCE_CALIB_BASE_PAIR_ORDER_HPP

#include <vector>

#include "calib/base/board.hpp"

namespace calib {

/// The action for the right view of a pair.
struct pair_turn {
    int quarters = 0;      // quarter turns; 2 is half a turn
    bool decided = false;  // false: ambiguous, leave the pair out
};

/// One answer for each pair; `left` and `right` have the same length. A pair with a missing view,
/// and any pair of a board without rotational symmetry, is returned as decided and not turned.
std::vector<pair_turn> pair_order(const board &board, const std::vector<board_view> &left,
                                  const std::vector<board_view> &right);

/// The same view, numbered from another corner of the board: 2 quarters on any board, 1 and 3 only
/// on boards with as many columns as rows.
board_view turned_view(const board &board, const board_view &view, int quarters);

}  // namespace calib

#endif

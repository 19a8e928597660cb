// SPDX-License-Identifier: Apache-2.0
/// Assigns grid corners to board corners.
#ifndef VERGENCE_CALIB_DETECT_DETECT_ORDER_HPP
#define VERGENCE_CALIB_DETECT_DETECT_ORDER_HPP

#include "calib/base/board.hpp"
#include "calib/detect/detect_markers.hpp"

namespace calib::detect {

/// Whether a grid has the size of a plain board in either orientation.
bool has_size_of(const board &board, const grid &found);

/// Numbers the corners of a grid of the board's size.
board_view plain_view(const board &board, const grid &found, const refined_grid &refined);

/// Numbers the corners of a part of a coded board.
board_view coded_view(const board &board, const grid &found, const refined_grid &refined,
                      const board_place &place);

/// Corners of such a part that would lie just beyond the first or last column of the board's.
int corners_beyond(const board &board, const grid &found, const refined_grid &refined,
                   const board_place &place);

}  // namespace calib::detect

#endif

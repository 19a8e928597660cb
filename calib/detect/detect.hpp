// SPDX-License-Identifier: Apache-2.0
/// Finds the board's inner corners in an image: nothing to click, no start values, no OpenCV.
#ifndef VERGENCE_CALIB_DETECT_DETECT_HPP
#define VERGENCE_CALIB_DETECT_DETECT_HPP

#include "calib/base/board.hpp"
#include "stereo/image/image.h"

namespace calib {

struct detect_options {
    /// Of the places that may be a corner, those of highest contrast that are looked at, on every
    /// level of the pyramid. Bounds the time on noise and texture.
    int most_candidates = 4000;
};

/// What `image` (upright, grey) shows of `board`. The corners of a plain board come only when the
/// whole board is seen (a corner or two may be hidden); of a coded board any part will do that
/// shows two markers. A plain board is numbered so that its top left square is black when its
/// colours can tell (columns + rows odd), else so that rows run to the right or down in the image;
/// which of both views of a pair must be turned then is `pair_order`'s decision.
///
/// The same input gives the same bytes. Keeps no state: may run in many threads at once.
board_view detect_board(const board &board, const image_u8 &image, const detect_options &options);

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// Finds the board's inner corners in an image, without clicks, start values or OpenCV.
#ifndef VERGENCE_CALIB_DETECT_DETECT_HPP
#define VERGENCE_CALIB_DETECT_DETECT_HPP

#include "calib/base/board.hpp"
#include "stereo/image/image.h"

namespace calib {

struct detect_options {
    /// Number of candidate points, those of highest contrast, that are examined on every pyramid
    /// level. Bounds the time spent on noise and texture.
    int max_candidates = 4000;
};

/// What `image` (upright, grey) shows of `board`. A plain board yields corners only when the whole
/// board is visible (a corner or two may be hidden); of a coded board any part with two markers
/// will do. A plain board is numbered so that its top left square is black if its colours determine
/// that (columns + rows odd), otherwise so that rows run to the right or down in the image;
/// `pair_order` decides which view of a pair must then be turned.
///
/// The same input gives the same bytes. Stateless: may run in many threads at once.
board_view detect_board(const board &board, const image_u8 &image, const detect_options &options);

}  // namespace calib

#endif

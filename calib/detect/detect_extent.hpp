// SPDX-License-Identifier: Apache-2.0
/// Whether a grid of a plain board's size is that board, or a part of a larger one.
#ifndef VERGENCE_CALIB_DETECT_DETECT_EXTENT_HPP
#define VERGENCE_CALIB_DETECT_DETECT_EXTENT_HPP

#include "calib/detect/refine_corners.hpp"

namespace calib::detect {

/// Whether at least half of the corners of each of the four outer lines are measured: noise can
/// make a line of its own.
bool outer_lines_measured(const grid &found, const refined_grid &refined);

/// Whether light and dark squares go on in `image` (level 0) beyond the squares around the outer
/// corners, on any side.
bool squares_continue(const plane &image, const grid &found, const refined_grid &refined);

}  // namespace calib::detect

#endif

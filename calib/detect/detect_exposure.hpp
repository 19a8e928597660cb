// SPDX-License-Identifier: Apache-2.0
/// Measures overexposure of the board in an image. Saturated pixels bleed, on CCD sensors along the
/// columns, and shift the edges of squares: on a real rig corners were 0.3 px too low in pictures
/// with clipped white squares.
#ifndef VERGENCE_CALIB_DETECT_DETECT_EXPOSURE_HPP
#define VERGENCE_CALIB_DETECT_DETECT_EXPOSURE_HPP

#include "calib/base/board.hpp"
#include "stereo/image/image.h"

namespace calib::detect {

/// Share of the white squares that is clipped, 0..1, sampled between four corners of `view`, whose
/// corners are in `image`. `clear_share`: how much of a square's side, from its edges inwards, is
/// free of markers (1 on a plain board). 0 when no square has four corners.
double clipped_share(const board &board, double clear_share, const image_u8 &image,
                     const board_view &view);

}  // namespace calib::detect

#endif

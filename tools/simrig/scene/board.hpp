// SPDX-License-Identifier: Apache-2.0
/// Calibration boards as exact functions of position: no texels, so corners are exact.
#ifndef VERGENCE_TOOLS_SIMRIG_SCENE_BOARD_HPP
#define VERGENCE_TOOLS_SIMRIG_SCENE_BOARD_HPP

#include "tools/simrig/world/vec.hpp"

namespace world {

/// The pattern is centred on the sheet; the first square (top left, seen from the front) is black.
struct Board {
    int columns = 0;  ///< squares
    int rows = 0;
    double square_mm = 0;
    /// 0: chessboard. Otherwise ChArUco: markers of OpenCV's DICT_4X4_50 in the white squares,
    /// numbered row by row as OpenCV 4.6 draws them.
    double marker_mm = 0;
};

/// Part of white (0 ink, 1 paper) around a place from the sheet's middle, averaged over a square of
/// these half sides and a Gaussian spot around it.
double board_white(const Board &board, Vec2 place_mm, double half_mm, double spot_mm);

}  // namespace world

#endif

// SPDX-License-Identifier: Apache-2.0
/// The board that a command line describes.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_BOARD_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_BOARD_HPP

#include <string>

#include "calib/base/board.hpp"

/// What the options say; null or 0 where one was not given.
struct calibrate_board_request {
    int corners[2] = {0, 0};        // along a row, rows
    double square = 0, marker = 0;  // in `unit`
    int unit = -1;                  // place in `calibrate_board_units`; -1: mm, as nothing was said
    const char *dictionary = nullptr;  // as in "5x5_50" or "DICT_5X5_50"
};

extern const char *const calibrate_board_units;  // "mm cm m"
/// Smallest and largest side of a square or marker that is taken, in any unit.
const double calibrate_board_side_min = 1e-6, calibrate_board_side_max = 1e5;

/// Checks and fills `*board`; a board so small that metres must be meant is refused unless the unit
/// was said. One sentence says what is wrong, "" when nothing is.
std::string calibrate_board_make(const calibrate_board_request &request, calib::board *board);

#endif

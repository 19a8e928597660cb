// SPDX-License-Identifier: Apache-2.0
/// The board that a command line describes.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_BOARD_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_BOARD_HPP

#include <string>

#include "calib/base/board.hpp"

/// Values of the options; null or 0 where not given.
struct calibrate_board_request {
    int corners[2] = {0, 0};           // along a row, rows
    double square = 0, marker = 0;     // in `unit`
    int unit = -1;                     // index in `calibrate_board_units`; -1: mm, not stated
    const char *dictionary = nullptr;  // as in "5x5_50" or "DICT_5X5_50"
};

extern const char *const calibrate_board_units;  // "mm cm m"
/// Smallest and largest accepted side of a square or marker, in any unit.
const double calibrate_board_side_min = 1e-6, calibrate_board_side_max = 1e5;

/// Checks and fills `*board`. A board so small that metres are likely is rejected unless the unit
/// was stated. Returns one sentence with what is wrong, "" when nothing is.
std::string calibrate_board_make(const calibrate_board_request &request, calib::board *board);

#endif

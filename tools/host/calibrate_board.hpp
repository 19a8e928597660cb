// SPDX-License-Identifier: Apache-2.0
/// The board that a command line describes.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_BOARD_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_BOARD_HPP

#include <string>

#include "calib/board.hpp"

/// What the options say; null or 0 where one was not given.
struct calibrate_board_request {
    int corners[2] = {0, 0};  // along a row, rows
    double square_mm = 0;
    const char *dictionary = nullptr;  // as in "5x5_50" or "DICT_5X5_50"
    double marker_mm = 0;
};

/// Checks and fills `*board`; one sentence says what is wrong, "" when nothing is.
std::string calibrate_board_make(const calibrate_board_request &request, calib::board *board);

#endif

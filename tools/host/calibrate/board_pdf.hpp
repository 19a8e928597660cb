// SPDX-License-Identifier: Apache-2.0
/// A printable calibration board: a one-page vector PDF, drawn to scale.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_BOARD_PDF_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_BOARD_PDF_HPP

#include <string>

#include "calib/base/board.hpp"

struct board_paper {
    std::string name;  // "A4", "letter", or "" when only the size was given
    double width_mm = 0, height_mm = 0;
};

/// "A4", "A3", "letter", ... in any case, or WIDTHxHEIGHT in mm. Returns false for anything else.
bool board_paper_parse(const std::string &text, board_paper *paper);

/// The names that `board_paper_parse` accepts, for messages.
std::string board_paper_names();

/// Side of the largest square, in steps of 0.1 mm, with which a board of this many corners fits on
/// the paper, in either orientation, including margins and caption.
double board_largest_square_mm(const calib::board &board, const board_paper &paper);

/// The page. The board must fit, see `board_largest_square_mm`. `scale_mm` receives the length of
/// the printed ruler. Marker and square sides are exact to 1e-4 mm.
std::string board_pdf(const calib::board &board, const board_paper &paper, double *scale_mm);

/// The board that a command line describes.

/// Values of the options; null or 0 where not given.
struct calibrate_board_request {
    const char *corners = nullptr;     // number along a row, number of rows: "9x6"
    double square = 0, marker = 0;     // sides in `unit`
    int unit = -1;                     // index in `calibrate_board_units`; -1: mm, not stated
    const char *dictionary = nullptr;  // name such as "5x5_50" or "DICT_5X5_50"
};

extern const char *const calibrate_board_units;  // "mm cm m"
/// Smallest and largest accepted side of a square or marker, in any unit.
const double calibrate_board_side_min = 1e-6, calibrate_board_side_max = 1e5;

/// Checks and fills `*board`. A board so small that metres are likely is rejected unless the unit
/// was stated. Returns one sentence with what is wrong, "" when nothing is.
std::string calibrate_board_make(const calibrate_board_request &request, calib::board *board);

#endif

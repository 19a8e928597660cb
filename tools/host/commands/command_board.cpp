// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdio>
#include <string>

#include "core/error.h"
#include "daemon/base/message.h"
#include "daemon/cli/options.h"
#include "tools/host/calibrate/board_pdf.hpp"
#include "tools/host/commands/commands.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/formats/whole_file.hpp"

namespace {

struct request {
    calibrate_board_request board;
    const char *paper, *out;
};

const command_argument options[] = {
    text_option("board", offsetof(request, board.corners), "COLUMNSxROWS",
                "Inner corners, along a row and from row to row, 2 to 255 each; squares are one "
                "more each way. A plain board with an odd and an even count has a unique "
                "orientation. Required."),
    number_option("square", COMMAND_NUMBER, offsetof(request, board.square), "MM",
                  "Side of one square. Required.", calibrate_board_side_min,
                  calibrate_board_side_max, 0, 0, "mm"),
    text_option("charuco", offsetof(request, board.dictionary), "DICT",
                "Put markers of this dictionary into the white squares, as OpenCV's CharucoBoard "
                "does: 4x4_50 "
                "to 7x7_1000, aruco_original, apriltag_36h11 and others."),
    number_option("marker", COMMAND_NUMBER, offsetof(request, board.marker), "MM",
                  "With --charuco: side of a marker, including its black border; about 3/4 of a "
                  "square is best.",
                  calibrate_board_side_min, calibrate_board_side_max, 0, 0, "mm"),
    choice_option("unit", offsetof(request, board.unit), "UNIT",
                  "Unit of --square and --marker. Default: mm, but boards below 20 mm across are "
                  "then rejected.",
                  calibrate_board_units),
    text_option(
        "paper", offsetof(request, paper), "PAPER",
        "A4, A3, A2, A1, A0, letter, legal, tabloid, or WIDTHxHEIGHT in mm. It is rotated if the "
        "board then fits better. Default: A4."),
    text_option("out", offsetof(request, out), "FILE", "The PDF to write. Required."),
};

const option_page page = {
    "vergence board",
    "",
    "make a printable calibration board",
    "Writes a PDF page with the board in its exact size, a ruler to check the print, and "
    "the options for \"vergence calibrate\". Print it at 100 % (not \"fit to page\"), measure the "
    "ruler, and glue the print onto something flat and stiff: glass, aluminium, a thick board.",
    "vergence board --board 9x6 --square 25 --out board.pdf\n"
    "vergence board --board 9x6 --square 38 --paper A3 --out board.pdf\n"
    "vergence board --board 9x6 --square 25 --charuco 5x5_50 --marker 19 --out coded.pdf",
    options,
    sizeof options / sizeof options[0],
    0,
    0,
};

const double square_min_mm = 1;
// Shares of a square's side. Around larger markers the white margin is too narrow for edge
// detection; smaller ones waste paper and can only be read from nearby.
const double marker_max = 0.9, marker_min = 0.4;
// OpenCV 4.6 read all markers of drawn boards up to this share, and missed up to four of ten from
// 0.79 to 0.9: it takes marker and square for two detections of one marker.
const double marker_opencv = 0.78;

/// Whether the markers of a board to be printed can be read; returns one sentence with what is
/// wrong.
std::string check_readable(const calib::board &board) {
    const double share = board.marker_mm / board.square_mm;
    if (!board.coded() || (share >= marker_min && share <= marker_max)) {
        return "";
    }
    return "--marker " + number_text(board.marker_mm, 6) +
           (share > marker_max ? " leaves too little white around a marker to read it"
                               : " is too small to be read from where the board fills an image") +
           ": with --square " + number_text(board.square_mm, 6) + " it must be from " +
           number_text(marker_min * board.square_mm, 6) + " to " +
           number_text(marker_max * board.square_mm, 6);
}

int refuse(int code, const std::string &text) {
    message line{};
    message_set(&line, 0, "%s", text.c_str());
    std::fprintf(stderr, "vergence board: %s\n", line.text);
    return code;
}

/// Checks the request and fills board and paper; one sentence says what is wrong, "" when all is
/// well.
std::string check(const request &asked, calib::board *board, board_paper *paper) {
    std::string error = calibrate_board_make(asked.board, board);
    error = error.empty() ? check_readable(*board) : error;
    if (!error.empty()) {
        return error;
    }
    if (asked.out == nullptr) {
        return "--out FILE is missing";
    }
    const std::string paper_text = asked.paper != nullptr ? asked.paper : "A4";
    if (!board_paper_parse(paper_text, paper)) {
        return "unknown --paper \"" + paper_text + "\" (expected one of: " + board_paper_names() +
               ")";
    }
    if (board->square_mm < square_min_mm) {
        return "--square: squares below " + number_text(square_min_mm, 6) + " mm cannot be printed";
    }
    const double largest_mm = board_largest_square_mm(*board, *paper);
    if (board->square_mm > largest_mm + 1e-9) {
        return "a board of " + std::to_string(board->columns + 1) + " x " +
               std::to_string(board->rows + 1) + " squares of " + number_text(board->square_mm, 6) +
               " mm does not fit on " + paper_text +
               " (largest squares that fit: " + number_text(largest_mm, 6) + " mm)";
    }
    return "";
}

}  // namespace

int command_board(int argc, char **argv) {
    request asked{};
    int count = 0;
    const int parsed = options_parse(&page, argc, argv, &asked, nullptr, &count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    calib::board board;
    board_paper paper;
    std::string error = check(asked, &board, &paper);
    if (!error.empty()) {
        return refuse(CLIENT_USAGE, error);
    }
    double ruler_mm = 0;
    const std::string pdf = board_pdf(board, paper, &ruler_mm);
    if (!whole_file_write(asked.out, pdf, &error)) {
        return refuse(CLIENT_FAILED, error);
    }
    if (board.coded() && board.marker_mm > marker_opencv * board.square_mm + 1e-9) {
        std::fprintf(stderr,
                     "vergence: note: OpenCV overlooks some markers larger than %s mm on such "
                     "squares\n",
                     number_text(marker_opencv * board.square_mm, 6).c_str());
    }
    std::printf("%s: %d x %d squares of %s mm; print at 100 %%, the ruler must be %s mm long\n",
                asked.out, board.columns + 1, board.rows + 1,
                number_text(board.square_mm, 6).c_str(), number_text(ruler_mm, 6).c_str());
    return CLIENT_OK;
}

// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_board.hpp"

#include <algorithm>
#include <cctype>

#include "calib/base/marker.hpp"
#include "daemon/surface/length_check.h"
#include "tools/host/formats/number_text.hpp"

namespace {

std::string dictionary_name(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const std::string prefix = "dict_";
    return text.compare(0, prefix.size(), prefix) == 0 ? text.substr(prefix.size()) : text;
}

std::string check_markers(const calibrate_board_request &request, const calib::board &board) {
    const calib::marker_dictionary *dictionary = calib::marker_dictionary_named(board.dictionary);
    if (dictionary == nullptr) {
        const calib::marker_dictionary_list all = calib::marker_dictionaries();
        std::string names;
        for (size_t i = 0; i < all.count; i++) {
            names += (i > 0 ? " " : "") + std::string(all.first[i].name);
        }
        return std::string("unknown --charuco \"") + request.dictionary +
               "\" (expected one of: " + names + ")";
    }
    if (!(request.marker > 0)) {
        return "--marker MM is missing (the side of a marker, including its black border)";
    }
    if (request.marker >= request.square) {
        return "--marker must be smaller than --square (markers are inside the white squares)";
    }
    const int needed = calib::board_marker_count(board);
    if (needed > dictionary->count) {
        return std::string("the board has ") + std::to_string(needed) + " markers, but " +
               board.dictionary + " has only " + std::to_string(dictionary->count) +
               ": use a larger dictionary of that kind";
    }
    return "";
}

const double units_mm[] = {1, 10, 1000};

// Whether the sides are valid square sizes in mm; "" when they are.
std::string check_size(const calibrate_board_request &request, const calib::board &board) {
    const double across_mm = (std::max(board.columns, board.rows) + 1) * board.square_mm;
    const std::string square = number_text(request.square, 6);
    if (board.square_mm < 1e-3 || board.square_mm > calibrate_board_side_max) {
        return "--square " + square + ": out of range: " + number_text(board.square_mm, 6) +
               " mm (expected 0.001 to " + number_text(calibrate_board_side_max, 6) + " mm)";
    }
    if (request.unit >= 0 || across_mm >= LENGTH_MIN_BOARD_MM) {
        return "";
    }
    return "--square " + square + ": the board would be " + number_text(across_mm, 4) +
           " mm across; below " + number_text(LENGTH_MIN_BOARD_MM, 4) +
           " mm the unit must be stated: --unit m for metres, --unit mm for millimetres";
}

}  // namespace

const char *const calibrate_board_units = "mm cm m";

std::string calibrate_board_make(const calibrate_board_request &request, calib::board *board) {
    if (request.corners[0] == 0) {
        return "--board COLUMNSxROWS is missing (the inner corners of the board, as in --board "
               "9x6)";
    }
    if (!(request.square > 0)) {
        return "--square MM is missing (the side of one square of the board)";
    }
    board->columns = request.corners[0];
    board->rows = request.corners[1];
    const double unit_mm = units_mm[std::max(request.unit, 0)];
    board->square_mm = request.square * unit_mm;
    const std::string wrong = check_size(request, *board);
    if (!wrong.empty()) {
        return wrong;
    }
    if (request.dictionary == nullptr) {
        return request.marker > 0 ? "--marker requires --charuco" : "";
    }
    board->dictionary = dictionary_name(request.dictionary);
    board->marker_mm = request.marker * unit_mm;
    return check_markers(request, *board);
}

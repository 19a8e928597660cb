// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate_board.hpp"

#include <algorithm>
#include <cctype>

#include "calib/marker.hpp"

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
        return std::string("--charuco \"") + request.dictionary + "\": must be one of: " + names;
    }
    if (!(request.marker_mm > 0)) {
        return "--marker MM is missing: the side of a marker, its black border included";
    }
    if (request.marker_mm >= request.square_mm) {
        return "--marker must be smaller than --square: markers stand inside the white squares";
    }
    const int needed = calib::board_marker_count(board);
    if (needed > dictionary->count) {
        return std::string("the board carries ") + std::to_string(needed) + " markers, but " +
               board.dictionary + " has only " + std::to_string(dictionary->count) +
               ": take a larger dictionary of that kind";
    }
    return "";
}

}  // namespace

std::string calibrate_board_make(const calibrate_board_request &request, calib::board *board) {
    if (request.corners[0] == 0) {
        return "--board COLUMNSxROWS is missing: the inner corners of the board, as in --board 9x6";
    }
    if (!(request.square_mm > 0)) {
        return "--square MM is missing: the side of one square of the board";
    }
    board->columns = request.corners[0];
    board->rows = request.corners[1];
    board->square_mm = request.square_mm;
    if (request.dictionary == nullptr) {
        return request.marker_mm > 0 ? "--marker belongs to --charuco" : "";
    }
    board->dictionary = dictionary_name(request.dictionary);
    board->marker_mm = request.marker_mm;
    return check_markers(request, *board);
}

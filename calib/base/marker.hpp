// SPDX-License-Identifier: Apache-2.0
/// Coded markers (ArUco, AprilTag): their dictionaries, and which marker is where on a coded board.
#ifndef VERGENCE_CALIB_BASE_MARKER_HPP
#define VERGENCE_CALIB_BASE_MARKER_HPP

#include <cstddef>
#include <cstdint>
#include <string>

#include "calib/base/board.hpp"

namespace calib {

/// A square of `side` x `side` bits, row by row from the top left, the first in the highest of the
/// side * side lowest bits; 1 is white. A black border one bit wide surrounds it.
using marker_code = uint64_t;

struct marker_dictionary {
    const char *name;
    int side;
    int count;
    int correctable_bits;  // number of wrong bits up to which a reading is still unique
    const marker_code *codes;
};

struct marker_dictionary_list {
    const marker_dictionary *first;
    size_t count;
};

/// All dictionaries: OpenCV's, with names like "4x4_50", "apriltag_36h11".
marker_dictionary_list marker_dictionaries();

/// The dictionary of that name; null if unknown. Static storage.
const marker_dictionary *marker_dictionary_named(const std::string &name);

/// A quarter turn of the code, counter-clockwise: the right column becomes the top row.
marker_code marker_turned(marker_code code, int side);

/// The mirrored code: columns in reverse order.
marker_code marker_mirrored(marker_code code, int side);

/// Squares of a board: one more than corners each way; square (0, 0), at the top left, is black.
inline bool board_square_white(int column, int row) {
    return (column + row) % 2 != 0;
}

/// The marker in the white square (column, row) of a coded board; markers are numbered from 0 along
/// the rows.
int board_marker_id(const board &board, int column, int row);

struct square_place {
    int column = 0, row = 0;
};

/// The square that carries marker `marker`, 0 <= marker < board_marker_count(board). `white_first`:
/// on a board whose top left square is white (see board_view).
square_place board_marker_square(const board &board, int marker, bool white_first = false);

/// The number of markers on a coded board.
int board_marker_count(const board &board);

}  // namespace calib

#endif

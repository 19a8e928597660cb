// SPDX-License-Identifier: Apache-2.0
#include "calib/base/marker.hpp"

namespace calib {

namespace {

marker_code bit_at(marker_code code, int side, int column, int row) {
    return code >> (side * side - 1 - row * side - column) & 1;
}

}  // namespace

const marker_dictionary *marker_dictionary_named(const std::string &name) {
    const marker_dictionary_list all = marker_dictionaries();
    for (size_t i = 0; i < all.count; i++) {
        if (name == all.first[i].name) {
            return &all.first[i];
        }
    }
    return nullptr;
}

marker_code marker_turned(marker_code code, int side) {
    marker_code made = 0;
    for (int row = 0; row < side; row++) {
        for (int column = 0; column < side; column++) {
            made = made << 1 | bit_at(code, side, side - 1 - row, column);
        }
    }
    return made;
}

marker_code marker_mirrored(marker_code code, int side) {
    marker_code made = 0;
    for (int row = 0; row < side; row++) {
        for (int column = 0; column < side; column++) {
            made = made << 1 | bit_at(code, side, side - 1 - column, row);
        }
    }
    return made;
}

int board_marker_id(const board &board, int column, int row) {
    // White squares of the rows above, then of this row up to here.
    const int above = row * (board.columns + 1) / 2;
    return above + column / 2;
}

square_place board_marker_square(const board &board, int marker, bool white_first) {
    // Along the rows, every other square is white.
    const int squares_in_row = board.columns + 1;
    for (int square = 2 * marker; square <= 2 * marker + 1; square++) {
        const int row = square / squares_in_row, column = square % squares_in_row;
        if (board_square_white(column, row) != white_first) {
            return {column, row};
        }
    }
    return {};
}

int board_marker_count(const board &board) {
    return (board.columns + 1) * (board.rows + 1) / 2;
}

}  // namespace calib

// SPDX-License-Identifier: Apache-2.0
/// The calibration board and what one camera sees of it.
#ifndef VERGENCE_CALIB_BASE_BOARD_HPP
#define VERGENCE_CALIB_BASE_BOARD_HPP

#include <string>
#include <vector>

namespace calib {

/// A flat board of squares. Inner corners are numbered row by row: corner `row * columns + column`
/// is at (column * square_mm, row * square_mm, 0) in the board's frame, with x along a row, y from
/// row to row, and z pointing away from the viewer.
struct board {
    int columns = 0, rows = 0;  // inner corners, 2..255 each way
    double square_mm = 0;       // side of a square
    /// Name of a marker dictionary ("4x4_50", "6x6_250", ...) when the white squares carry coded
    /// markers (ChArUco); "" for a plain chessboard.
    std::string dictionary;
    double marker_mm = 0;  // side of a marker, its black border included; 0 on a plain board

    bool coded() const { return !dictionary.empty(); }
    int corner_count() const { return columns * rows; }
    /// A plain board looks the same after half a turn unless one count is odd and the other even.
    bool looks_same_turned() const { return !coded() && (columns + rows) % 2 == 0; }
};

/// One inner corner in one image.
struct corner {
    int index = 0;              // number of the corner on the board, 0..corner_count()-1
    double x_px = 0, y_px = 0;  // (0,0) is the centre of the top-left pixel
    double sigma_px = 0;        // predicted standard deviation of x and of y; weights the corner
};

/// What was found of the board in one image. Corners are sorted by index, each at most once.
struct board_view {
    std::vector<corner> corners;
    std::string rejection;  // why the view cannot be used, one line; "" when it can
    double clipped = 0;     // overexposed share of the white squares, 0..1
    /// The markers of a coded board are those of OpenCV before 4.6 for an even number of rows of
    /// squares: the square at the top left is white. Corners are numbered alike in both layouts.
    bool white_first = false;
    bool layout_open = false;  // the markers seen fit both layouts: see coded_layout.hpp

    bool overexposed() const { return clipped > 0.5; }
};

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// Images of calibration boards with exact truth: perspective and distortion, pixels
/// that integrate over their area, Gaussian blur, noise. Shares with calib/ only the description of
/// the board and the markers' bits.
#ifndef VERGENCE_TESTS_SYNTHETIC_BOARD_IMAGE_HPP
#define VERGENCE_TESTS_SYNTHETIC_BOARD_IMAGE_HPP

#include <cstdint>
#include <vector>

#include "calib/base/board.hpp"
#include "stereo/image/image.h"
#include "synthetic/camera.hpp"

namespace synthetic {

/// From the board's frame (see calib::board) to the camera's.
struct BoardPose {
    Matrix R_camera_board{1, 0, 0, 0, 1, 0, 0, 0, 1};
    Vector t_camera_board_mm;
};

/// Pose of a board: its squares (without the margin) cover `width_share` of the image's width when
/// it faces the camera; then it is rotated, and its centre moved by shares of the image.
struct BoardHold {
    double width_share = 0.75;
    Vector turn_rad;
    double shift_x = 0, shift_y = 0;
};

BoardPose hold_board(const calib::board &board, const Camera &camera, const BoardHold &hold);

struct BoardLight {
    double dark_grey = 35, light_grey = 205, background_grey = 95;
    double margin_squares = 1;  // width of the white margin around the squares
    double ink_squares = 0;     // spread of the ink beyond each side of a black square
    double shade = 0;           // brightness falls by this share from the left to the right edge
    double blur_px = 1;         // standard deviation of the lens's blur
    double noise_grey = 2;
    uint64_t seed = 1;
    bool white_first = false;  // a coded board as OpenCV before 4.6 drew an even number of rows
};

struct BoardImage {
    int width = 0, height = 0;
    std::vector<uint8_t> pixels;
    std::vector<Pixel> corners;  // truth, by index; also those outside the image

    image_u8 view() { return {pixels.data(), width, height, width}; }
};

/// `camera` is at its own origin: its position in the world is ignored.
BoardImage photograph(const calib::board &board, const Camera &camera, const BoardPose &pose,
                      const BoardLight &light);

}  // namespace synthetic

#endif

// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_exposure.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace calib::detect {

namespace {

constexpr int clipped_grey = 254;  // compressed pictures vary by one

const corner *corner_at(const std::vector<const corner *> &by_index, const board &board, int column,
                        int row) {
    return by_index[static_cast<size_t>(row * board.columns + column)];
}

bool is_clipped(const image_u8 &image, double x_px, double y_px) {
    const long x = std::lround(x_px), y = std::lround(y_px);
    return x >= 0 && y >= 0 && x < image.width && y < image.height &&
           image.data[y * image.stride + x] >= clipped_grey;
}

}  // namespace

double clipped_share(const board &board, double clear_share, const image_u8 &image,
                     const board_view &view) {
    std::vector<const corner *> by_index(static_cast<size_t>(board.corner_count()));
    for (const corner &one : view.corners) {
        by_index[static_cast<size_t>(one.index)] = &one;
    }
    // Which squares are white need not be known: they are the ones with more clipped pixels.
    long looked_at[2] = {0, 0}, clipped[2] = {0, 0};
    const double inset = std::min(0.25, 0.6 * clear_share);
    for (int row = 0; row + 1 < board.rows; row++) {
        for (int column = 0; column + 1 < board.columns; column++) {
            const corner *const square[4] = {corner_at(by_index, board, column, row),
                                             corner_at(by_index, board, column + 1, row + 1),
                                             corner_at(by_index, board, column + 1, row),
                                             corner_at(by_index, board, column, row + 1)};
            if (std::count(square, square + 4, nullptr) > 0) {
                continue;
            }
            const int colour = (row + column) % 2;
            for (int i = 0; i < 4; i++) {
                const corner &near = *square[i], &opposite = *square[i ^ 1];
                looked_at[colour]++;
                clipped[colour] +=
                    is_clipped(image, near.x_px + inset * (opposite.x_px - near.x_px),
                               near.y_px + inset * (opposite.y_px - near.y_px));
            }
        }
    }
    double share = 0;
    for (int colour = 0; colour < 2; colour++) {
        if (looked_at[colour] > 0) {
            share = std::max(share, static_cast<double>(clipped[colour]) /
                                        static_cast<double>(looked_at[colour]));
        }
    }
    return share;
}

}  // namespace calib::detect

// SPDX-License-Identifier: Apache-2.0
/// Random boards, lenses and board poses; and errors of found corners.
#ifndef VERGENCE_TESTS_SYNTHETIC_BOARD_CASES_HPP
#define VERGENCE_TESTS_SYNTHETIC_BOARD_CASES_HPP

#include <algorithm>
#include <cmath>
#include <string>

#include "synthetic/board_image.hpp"
#include "synthetic/scene.hpp"
#include "synthetic/seed.hpp"

namespace synthetic {

inline calib::board plain_board(int columns, int rows) {
    calib::board board;
    board.columns = columns;
    board.rows = rows;
    board.square_mm = 30;
    return board;
}

inline calib::board coded_board(int columns, int rows, const std::string &dictionary) {
    calib::board board = plain_board(columns, rows);
    board.dictionary = dictionary;
    board.marker_mm = 0.7 * board.square_mm;
    return board;
}

/// A lens of normal width with some barrel distortion.
inline Camera lens_of(int width, int height, Random &random) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.fx = camera.fy = random.uniform(1.0, 1.6) * width;
    camera.cx = width / 2.0 + random.uniform(-0.01, 0.01) * width;
    camera.cy = height / 2.0 + random.uniform(-0.01, 0.01) * width;
    camera.k1 = random.uniform(-0.25, 0.05);
    camera.k2 = random.uniform(0, 0.1);
    camera.p1 = random.uniform(-0.001, 0.001);
    camera.p2 = random.uniform(-0.001, 0.001);
    return camera;
}

/// Tilted and rolled up to the given angles, moved as far as a board of that size can be.
inline BoardHold random_hold(double width_share, double tilt_rad, double roll_rad, Random &random) {
    BoardHold hold;
    hold.width_share = width_share;
    hold.turn_rad = {random.uniform(-tilt_rad, tilt_rad), random.uniform(-tilt_rad, tilt_rad),
                     random.uniform(-roll_rad, roll_rad)};
    const double room = std::max(0.0, 0.8 - width_share) / 2.5;
    hold.shift_x = random.uniform(-room, room);
    hold.shift_y = random.uniform(-room, room);
    return hold;
}

/// Errors of corners against the truth, x and y alike.
class Errors {
  public:
    void add(const BoardImage &image, const calib::board_view &view) {
        for (const calib::corner &c : view.corners) {
            const Pixel &truth = image.corners[static_cast<size_t>(c.index)];
            for (const double error : {c.x_px - truth.x, c.y_px - truth.y}) {
                square_sum_ += error * error;
                z_sum_ += error * error / (c.sigma_px * c.sigma_px);
                worst_px_ = std::max(worst_px_, std::fabs(error));
                count_++;
            }
        }
    }
    double rms_px() const { return std::sqrt(square_sum_ / count_); }
    double z_rms() const { return std::sqrt(z_sum_ / count_); }
    double worst_px() const { return worst_px_; }

  private:
    double square_sum_ = 0, z_sum_ = 0, worst_px_ = 0;
    int count_ = 0;
};

}  // namespace synthetic

#endif

// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/robust_reason.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/base/sentence.hpp"
#include "core/math.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

// A corner is attributed to another one's place when it is this close to it, as a share of a
// square.
const double CLOSE = 0.25;

// Pixels of all corners of a board; far away for corners behind the camera.
std::vector<std::array<double, 2>> all_pixels(const bundle &data, int camera,
                                              const bundle_state &state,
                                              const rigid &T_left_board) {
    std::vector<std::array<double, 2>> pixels;
    for (int index = 0; index < int(data.points.size()); index++) {
        const bundle_corner at_zero{index, 0, 0, 1, true};
        double pixel[2];
        if (!corner_residual(data, camera, at_zero, state, T_left_board, pixel)) {
            pixel[0] = pixel[1] = 1e9;
        }
        pixels.push_back({pixel[0], pixel[1]});
    }
    return pixels;
}

double distance(const std::array<double, 2> &a, const std::array<double, 2> &b) {
    return std::hypot(a[0] - b[0], a[1] - b[1]);
}

// A way to misnumber a board.
struct misnumbering {
    const char *text;
    bool half_turn;
    int rows, columns;  // shift
};

const misnumbering MISNUMBERINGS[] = {
    {"the two views number the board from opposite ends (half a turn)", true, 0, 0},
    {"the right view's numbers are one row too low", false, 1, 0},
    {"the right view's numbers are one row too high", false, -1, 0},
    {"the right view's numbers are one column too low", false, 0, 1},
    {"the right view's numbers are one column too high", false, 0, -1},
};

// The index that a corner should have had; -1 if not found.
int renumbered(const misnumbering &how, const board &target, int index) {
    if (how.half_turn) {
        return target.corner_count() - 1 - index;
    }
    const int row = index / target.columns + how.rows;
    const int column = index % target.columns + how.columns;
    const bool exists = row >= 0 && row < target.rows && column >= 0 && column < target.columns;
    return exists ? row * target.columns + column : -1;
}

// Median distance of the view's corners from their predicted places, in squares, after renumbering;
// large when fewer than half then have a number.
double median_off(const bundle_view &view, const board &target, const misnumbering &how,
                  const std::vector<std::array<double, 2>> &predicted, double square_px) {
    std::vector<double> off;
    for (const bundle_corner &corner : view.corners) {
        const int index = renumbered(how, target, corner.index);
        if (index >= 0) {
            off.push_back(distance(predicted[size_t(index)], {corner.x_px, corner.y_px}));
        }
    }
    if (off.empty() || 2 * off.size() < view.corners.size()) {
        return 1e9;
    }
    std::nth_element(off.begin(), off.begin() + long(off.size() / 2), off.end());
    return off[off.size() / 2] / square_px;
}

}  // namespace

std::string corner_reason(const bundle &data, int camera, const bundle_corner &corner,
                          const bundle_state &state, const rigid &T_left_board, double off_px) {
    const auto pixels = all_pixels(data, camera, state, T_left_board);
    const std::array<double, 2> seen = {corner.x_px, corner.y_px};
    size_t nearest = 0;
    double square_px = 1e9;  // predicted distance from this corner to the nearest other one
    for (size_t i = 0; i < pixels.size(); i++) {
        if (distance(pixels[i], seen) < distance(pixels[nearest], seen)) {
            nearest = i;
        }
        if (i != size_t(corner.index)) {
            square_px = std::min(square_px, distance(pixels[i], pixels[size_t(corner.index)]));
        }
    }
    return nearest != size_t(corner.index) && distance(pixels[nearest], seen) < CLOSE * square_px
               ? sentence("is at the place of corner %zu, %.1f px off", nearest, off_px)
               : sentence("is %.2f px off", off_px);
}

mismatch explain_mismatch(const bundle &data, const bundle_state &state, size_t capture,
                          const board &target, const rigid &left, const rigid &right) {
    const bundle_view &view = data.captures[capture][RIGHT];
    const auto predicted = all_pixels(data, RIGHT, state, left);
    const double square_px = std::max(1.0, distance(predicted[0], predicted[predicted.size() - 1]) /
                                               std::hypot(target.columns - 1, target.rows - 1));
    mismatch result;
    double min = CLOSE;
    for (const misnumbering &how : MISNUMBERINGS) {
        const double off = median_off(view, target, how, predicted, square_px);
        if (off < min) {
            min = off;
            result.half_turn = how.half_turn;
            result.reason = how.text;
        }
    }
    if (result.reason.empty()) {
        const double moved_mm[3] = {right.t_mm[0] - left.t_mm[0], right.t_mm[1] - left.t_mm[1],
                                    right.t_mm[2] - left.t_mm[2]};
        const bool overexposed = view.overexposed || data.captures[capture][LEFT].overexposed;
        result.reason = sentence(
            "left and right do not show the same board position (%.1f mm and %.1f degrees "
            "apart): %s",
            geometry_norm(moved_mm), turn_between_rad(left, right) * 180 / MATH_PI,
            overexposed ? "overexposed, which moves corners, or not taken at the same moment"
                        : "not taken at the same moment, or wrongly paired");
    }
    return result;
}

}  // namespace calib

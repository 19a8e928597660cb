// SPDX-License-Identifier: Apache-2.0
#include "calib/bundle/bundle.hpp"

#include <algorithm>
#include <cmath>

#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

namespace calib {

int bundle_view::used_count() const {
    return int(std::count_if(corners.begin(), corners.end(),
                             [](const bundle_corner &corner) { return corner.used; }));
}

bool bundle::used(size_t capture) const {
    INVARIANT(capture < captures.size());
    return captures[capture][LEFT].used || captures[capture][RIGHT].used;
}

std::vector<board_point> make_board_points(const board &board, double half_mm[2]) {
    INVARIANT(board.columns >= 2 && board.rows >= 2 && board.square_mm > 0);
    half_mm[0] = 0.5 * (board.columns - 1) * board.square_mm;
    half_mm[1] = 0.5 * (board.rows - 1) * board.square_mm;
    std::vector<board_point> points;
    points.reserve(size_t(board.corner_count()));
    for (int row = 0; row < board.rows; row++) {
        for (int column = 0; column < board.columns; column++) {
            const double x = column * board.square_mm - half_mm[0];
            const double y = row * board.square_mm - half_mm[1];
            const double a = x / half_mm[0], b = y / half_mm[1];
            // Has zero mean over the board, so that the warp cannot be mistaken for a distance.
            const double stretch_mm = 0.5 / half_mm[0];
            points.push_back({x,
                              y,
                              {a * a - 1.0 / 3, b * b - 1.0 / 3, a * b},
                              {stretch_mm * x, -stretch_mm * y}});
        }
    }
    INVARIANT(points.size() == size_t(board.corner_count()));
    return points;
}

bundle single_camera(const bundle &data, int camera) {
    INVARIANT(camera >= 0 && camera < data.cameras);
    bundle result;
    result.cameras = 1;
    result.frame[LEFT] = data.frame[camera];
    result.points = data.points;
    result.half_mm[0] = data.half_mm[0];
    result.half_mm[1] = data.half_mm[1];
    for (const auto &capture : data.captures) {
        result.captures.emplace_back();
        result.captures.back()[LEFT] = capture[size_t(camera)];
    }
    return result;
}

double print_stretch(const bundle &data, const bundle_state &state) {
    INVARIANT(data.half_mm[0] > 0 && data.half_mm[1] > 0);
    return std::fabs(state.warp_mm[board_model::STRETCH]) / data.half_mm[0];
}

void warped(const board_point &point, const double warp_mm[WARP_PARAMETERS], double point_mm[3]) {
    point_mm[0] = point.x_mm + warp_mm[board_model::STRETCH] * point.stretch[0];
    point_mm[1] = point.y_mm + warp_mm[board_model::STRETCH] * point.stretch[1];
    point_mm[2] = 0;
    for (int i = 0; i < 3; i++) {
        point_mm[2] += warp_mm[i] * point.lift[i];
    }
}

namespace {

// by_turn = by_point (-[arm]x): the effect of rotating `arm`.
void turn_rows(const double by_point[3], const double arm[3], double by_turn[3]) {
    by_turn[0] = by_point[2] * arm[1] - by_point[1] * arm[2];
    by_turn[1] = by_point[0] * arm[2] - by_point[2] * arm[0];
    by_turn[2] = by_point[1] * arm[0] - by_point[0] * arm[1];
}

}  // namespace

bool make_corner_rows(const bundle &data, int camera, const bundle_corner &corner,
                      const lens_state &lens, const rigid &T_left_board, const rigid &T_right_left,
                      const double warp_mm[WARP_PARAMETERS], corner_rows *rows) {
    INVARIANT(camera >= 0 && camera < data.cameras);
    INVARIANT(corner.index >= 0 && size_t(corner.index) < data.points.size());
    const board_point &drawn = data.points[size_t(corner.index)];
    double on_board[3], arm[3], in_left[3], in_camera[3], arm_right[3] = {0, 0, 0};
    warped(drawn, warp_mm, on_board);
    geometry_rotate(T_left_board.R, on_board, arm);
    for (int i = 0; i < 3; i++) {
        in_left[i] = arm[i] + T_left_board.t_mm[i];
        in_camera[i] = in_left[i];
    }
    if (camera == RIGHT) {
        geometry_rotate(T_right_left.R, in_left, arm_right);
        for (int i = 0; i < 3; i++) {
            in_camera[i] = arm_right[i] + T_right_left.t_mm[i];
        }
    }
    projection seen;
    if (!project(data.frame[camera], lens, in_camera, &seen)) {
        return false;
    }
    const double measured[2] = {corner.x_px, corner.y_px};
    const double z_mm = T_left_board.t_mm[2];
    for (int axis = 0; axis < 2; axis++) {
        rows->residual_px[axis] = seen.pixel_px[axis] - measured[axis];
        std::copy_n(seen.by_lens[axis], int(LENS_PARAMETERS), rows->by_lens[axis]);
        double by_left[3];  // px per mm of the left frame
        double *by_rig = rows->by_rig[axis], *by_board = rows->by_board[axis];
        if (camera == RIGHT) {
            geometry_rotate_back(T_right_left.R, seen.by_point[axis], by_left);
            turn_rows(seen.by_point[axis], arm_right, by_rig);
            std::copy_n(seen.by_point[axis], 3, by_rig + 3);
        } else {
            std::copy_n(seen.by_point[axis], 3, by_left);
            std::fill_n(by_rig, int(POSE_PARAMETERS), 0.0);
        }
        turn_rows(by_left, arm, by_board);
        by_board[3] = by_left[0] * z_mm;
        by_board[4] = by_left[1] * z_mm;
        by_board[5] = geometry_dot(by_left, T_left_board.t_mm);
        double by_drawn[3];  // px per mm of the board's frame
        geometry_rotate_back(T_left_board.R, by_left, by_drawn);
        for (int i = 0; i < 3; i++) {
            rows->by_warp[axis][i] = by_drawn[2] * drawn.lift[i];
        }
        rows->by_warp[axis][board_model::STRETCH] =
            by_drawn[0] * drawn.stretch[0] + by_drawn[1] * drawn.stretch[1];
    }
    return true;
}

bool corner_residual(const bundle &data, int camera, const bundle_corner &corner,
                     const bundle_state &state, const rigid &T_left_board, double residual_px[2]) {
    INVARIANT(camera >= 0 && camera < data.cameras);
    INVARIANT(corner.index >= 0 && size_t(corner.index) < data.points.size());
    double on_board[3], in_left[3], in_right[3], pixel[2];
    warped(data.points[size_t(corner.index)], state.warp_mm, on_board);
    apply(T_left_board, on_board, in_left);
    if (camera == RIGHT) {
        apply(state.T_right_left, in_left, in_right);
    }
    if (!project(data.frame[camera], state.lens[camera], camera == RIGHT ? in_right : in_left,
                 pixel)) {
        return false;
    }
    residual_px[0] = pixel[0] - corner.x_px;
    residual_px[1] = pixel[1] - corner.y_px;
    return true;
}

rigid moved_board(const rigid &T_left_board, const double increment[POSE_PARAMETERS]) {
    INVARIANT(T_left_board.t_mm[2] > 0);
    rigid result = turned(T_left_board, increment);
    const double *t = T_left_board.t_mm;
    const double z = t[2] * std::exp(increment[5]);
    result.t_mm[0] = z * (t[0] / t[2] + increment[3]);
    result.t_mm[1] = z * (t[1] / t[2] + increment[4]);
    result.t_mm[2] = z;
    return result;
}

rigid moved_rig(const rigid &T_right_left, const double increment[POSE_PARAMETERS]) {
    rigid result = turned(T_right_left, increment);
    for (int i = 0; i < 3; i++) {
        result.t_mm[i] += increment[3 + i];
    }
    return result;
}

bundle_options options_of(lens_model lens, board_model board, double loss_scale) {
    bundle_options options;
    for (int parameter = 0; parameter < LENS_PARAMETERS; parameter++) {
        options.free_lens[size_t(parameter)] = lens.estimates(parameter);
    }
    for (int parameter = 0; parameter < WARP_PARAMETERS; parameter++) {
        options.free_warp[size_t(parameter)] = board.estimates(parameter);
    }
    options.loss_scale = loss_scale;
    return options;
}

bool spans_area(const bundle &data, const bundle_view &view, int min) {
    double sum[5] = {0, 0, 0, 0, 0}, x = 0, y = 0;
    const int count = view.used_count();
    if (count < min || count == 0) {
        return false;
    }
    for (const bundle_corner &corner : view.corners) {
        const board_point &point = data.points[size_t(corner.index)];
        if (corner.used) {
            x += point.x_mm / count;
            y += point.y_mm / count;
        }
    }
    for (const bundle_corner &corner : view.corners) {
        const board_point &point = data.points[size_t(corner.index)];
        if (corner.used) {
            sum[0] += (point.x_mm - x) * (point.x_mm - x);
            sum[1] += (point.x_mm - x) * (point.y_mm - y);
            sum[2] += (point.y_mm - y) * (point.y_mm - y);
        }
    }
    // The narrow direction of the point cloud over its wide one.
    const double trace = sum[0] + sum[2], area2 = sum[0] * sum[2] - sum[1] * sum[1];
    return area2 > 1e-3 * trace * trace;
}

}  // namespace calib

// SPDX-License-Identifier: Apache-2.0
#include "calib/uncertainty.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/geometry.h"
#include "core/invariant.h"

namespace calib {

namespace {

// Places of the shared numbers.
enum {
    LENS_AT = 0,
    RIG_AT = CAMERAS * LENS_PLACES,
    WARP_AT = RIG_AT + POSE_PLACES,
    SHARED = WARP_AT + WARP_PLACES,
    FRAME_AT = SHARED,  // turn and shift of the boards' frame
    SIZE = SHARED + POSE_PLACES,
};

using matrix = Eigen::MatrixXd;
using shared_rows = Eigen::Matrix<double, 2, SHARED>;
using board_rows = Eigen::Matrix<double, 2, POSE_PLACES>;
using square6 = Eigen::Matrix<double, POSE_PLACES, POSE_PLACES>;

void spread(const corner_rows &rows, int camera, double weight, shared_rows *shared,
            board_rows *board) {
    shared->setZero();
    for (int axis = 0; axis < 2; axis++) {
        for (int i = 0; i < LENS_PLACES; i++) {
            (*shared)(axis, LENS_AT + camera * LENS_PLACES + i) = weight * rows.by_lens[axis][i];
        }
        for (int i = 0; i < POSE_PLACES; i++) {
            (*shared)(axis, RIG_AT + i) = weight * rows.by_rig[axis][i];
            (*board)(axis, i) = weight * rows.by_board[axis][i];
        }
        for (int i = 0; i < WARP_PLACES; i++) {
            (*shared)(axis, WARP_AT + i) = weight * rows.by_warp[axis][i];
        }
    }
}

std::vector<int> free_places(const bundle &data, const bundle_options &options) {
    std::vector<int> places;
    for (int i = 0; i < data.cameras * LENS_PLACES; i++) {
        if (options.free_lens[size_t(i % LENS_PLACES)]) {
            places.push_back(LENS_AT + i);
        }
    }
    for (int i = 0; data.cameras == CAMERAS && i < POSE_PLACES; i++) {
        places.push_back(RIG_AT + i);
    }
    for (int i = 0; options.free_warp && i < WARP_PLACES; i++) {
        places.push_back(WARP_AT + i);
    }
    return places;
}

// Normal equations with every board eliminated, one board after the other.
struct reduced_equations {
    Eigen::Matrix<double, SHARED, SHARED> shared = Eigen::Matrix<double, SHARED, SHARED>::Zero();
    // The boards' frame: mean over the boards of their increments, as it follows the shared numbers
    // and by its own noise.
    Eigen::Matrix<double, POSE_PLACES, SHARED> frame_by_shared =
        Eigen::Matrix<double, POSE_PLACES, SHARED>::Zero();
    square6 frame_noise = square6::Zero();
    double squares = 0;
    long residuals = 0;
    int boards = 0;
};

// What a board's increment does to the frame: turn, then shift of the left frame's origin.
square6 frame_by_board(const rigid &T_left_board) {
    const double *t = T_left_board.t_mm;
    square6 M = square6::Zero();
    M.topLeftCorner<3, 3>().setIdentity();
    // shift = dt - turn x t
    M(3, 1) = -t[2];
    M(3, 2) = t[1];
    M(4, 0) = t[2];
    M(4, 2) = -t[0];
    M(5, 0) = -t[1];
    M(5, 1) = t[0];
    M(3, 3) = t[2];
    M(4, 4) = t[2];
    for (int i = 0; i < 3; i++) {
        M(3 + i, 5) = t[i];
    }
    return M;
}

void eliminate(const bundle &data, const bundle_state &state, size_t sighting,
               reduced_equations *result) {
    square6 board = square6::Zero();
    Eigen::Matrix<double, SHARED, POSE_PLACES> mixed =
        Eigen::Matrix<double, SHARED, POSE_PLACES>::Zero();
    const rigid &pose = state.T_left_board[sighting];
    for (int camera = 0; camera < data.cameras; camera++) {
        const bundle_view &view = data.sightings[sighting][size_t(camera)];
        for (const bundle_corner &corner : view.corners) {
            corner_rows rows;
            if (!view.used || !corner.used ||
                !make_corner_rows(data, camera, corner, state.lens[camera], pose,
                                  state.T_right_left, state.warp_mm, &rows)) {
                continue;
            }
            const double weight = 1 / corner.sigma_px;
            shared_rows by_shared;
            board_rows by_board;
            spread(rows, camera, weight, &by_shared, &by_board);
            result->shared.noalias() += by_shared.transpose() * by_shared;
            mixed.noalias() += by_shared.transpose() * by_board;
            board.noalias() += by_board.transpose() * by_board;
            for (const double residual : rows.residual_px) {
                result->squares += weight * weight * residual * residual;
            }
            result->residuals += 2;
        }
    }
    const square6 inverse = board.ldlt().solve(square6::Identity());
    const square6 M = frame_by_board(pose);
    result->shared.noalias() -= mixed * inverse * mixed.transpose();
    result->frame_by_shared.noalias() -= M * inverse * mixed.transpose();
    result->frame_noise.noalias() += M * inverse * M.transpose();
    result->boards++;
}

// Inverse of a symmetric matrix with its diagonal scaled to 1; what it cannot know becomes huge,
// not infinite.
matrix inverse_of(const matrix &A, bool *singular) {
    const Eigen::VectorXd scale = A.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const matrix scaled = scale.asDiagonal() * A * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<matrix> eigen(scaled);
    const double least = 1e-13 * eigen.eigenvalues().maxCoeff();
    *singular = !(eigen.eigenvalues().minCoeff() > least);
    const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(least).cwiseInverse();
    return scale.asDiagonal() * eigen.eigenvectors() * values.asDiagonal() *
           eigen.eigenvectors().transpose() * scale.asDiagonal();
}

// Turn and shift of the frame move a point: by_left of a pixel becomes its row by the frame.
void frame_row(const double by_left[3], const double point_mm[3], bool far, double *row) {
    double turn[3];
    geometry_cross(point_mm, by_left, turn);  // by_left . (w x p) = w . (p x by_left)
    for (int i = 0; i < 3; i++) {
        row[i] = turn[i];
        row[3 + i] = far ? 0 : by_left[i];
    }
}

}  // namespace

error_model::error_model(const bundle &data, const bundle_options &options,
                         const bundle_state &state)
    : state_(state),
      frame_{data.frame[LEFT], data.frame[RIGHT]},
      cameras_(data.cameras),
      covariance_(size_t(SIZE * SIZE), 0.0) {
    reduced_equations equations;
    for (size_t i = 0; i < data.sightings.size(); i++) {
        if (data.used(i)) {
            eliminate(data, state, i, &equations);
        }
    }
    const std::vector<int> places = free_places(data, options);
    const long count = long(places.size());
    matrix reduced(count, count), follow(SIZE, count);
    follow.setZero();
    for (long row = 0; row < count; row++) {
        for (long column = 0; column < count; column++) {
            reduced(row, column) = equations.shared(places[size_t(row)], places[size_t(column)]);
        }
        follow(places[size_t(row)], row) = 1;
        follow.col(row).tail<POSE_PLACES>() =
            equations.frame_by_shared.col(places[size_t(row)]) / std::max(1, equations.boards);
    }
    const long spare = equations.residuals - count - long(POSE_PLACES) * equations.boards;
    sigma0_ = std::sqrt(equations.squares / double(std::max(1L, spare)));
    const matrix inverse = inverse_of(reduced, &singular_);
    singular_ = singular_ || spare < 1;
    Eigen::Map<matrix> result(covariance_.data(), SIZE, SIZE);
    result = follow * inverse * follow.transpose();
    result.bottomRightCorner<POSE_PLACES, POSE_PLACES>() +=
        equations.frame_noise / (double(equations.boards) * equations.boards);
    result *= sigma0_ * sigma0_;
}

void error_model::widen(double factor) {
    INVARIANT(factor >= 1);
    for (double &value : covariance_) {
        value *= factor * factor;
    }
}

double error_model::covariance(const std::vector<double> &a, const std::vector<double> &b) const {
    INVARIANT(a.size() == SIZE && b.size() == SIZE);
    const Eigen::Map<const matrix> C(covariance_.data(), SIZE, SIZE);
    return Eigen::Map<const Eigen::VectorXd>(a.data(), SIZE)
        .dot(C * Eigen::Map<const Eigen::VectorXd>(b.data(), SIZE));
}

double error_model::variance(const std::vector<double> &row) const {
    return std::max(0.0, covariance(row, row));
}

double error_model::lens_sigma(int camera, int place) const {
    std::vector<double> row(SIZE, 0.0);
    row[size_t(LENS_AT + camera * LENS_PLACES + place)] = 1;
    return std::sqrt(variance(row));
}

double error_model::rig_sigma(int place) const {
    std::vector<double> row(SIZE, 0.0);
    row[size_t(RIG_AT + place)] = 1;
    return std::sqrt(variance(row));
}

double error_model::baseline_sigma_mm() const {
    const double *t = state_.T_right_left.t_mm;
    const double length = geometry_norm(t);
    std::vector<double> row(SIZE, 0.0);
    for (size_t i = 0; i < 3; i++) {
        row[RIG_AT + 3 + i] = t[i] / length;
    }
    return std::sqrt(variance(row));
}

bool error_model::pixel_rows(int camera, const double in_left_mm[3], bool far,
                             std::vector<double> (&rows)[2], double by_left[2][3]) const {
    double in_camera[3], arm[3] = {0, 0, 0};
    std::copy_n(in_left_mm, 3, in_camera);
    if (camera == RIGHT) {
        geometry_rotate(state_.T_right_left.R, in_left_mm, arm);
        for (int i = 0; i < 3; i++) {
            in_camera[i] = arm[i] + (far ? 0 : state_.T_right_left.t_mm[i]);
        }
    }
    projection seen;
    if (!project(frame_[camera], state_.lens[camera], in_camera, &seen)) {
        return false;
    }
    for (int axis = 0; axis < 2; axis++) {
        rows[axis].assign(SIZE, 0.0);
        std::copy_n(seen.by_lens[axis], int(LENS_PLACES),
                    rows[axis].begin() + LENS_AT + camera * LENS_PLACES);
        if (camera == RIGHT) {
            frame_row(seen.by_point[axis], arm, far, rows[axis].data() + RIG_AT);
            geometry_rotate_back(state_.T_right_left.R, seen.by_point[axis], by_left[axis]);
        } else {
            std::copy_n(seen.by_point[axis], 3, by_left[axis]);
        }
    }
    return true;
}

bool error_model::projection_covariance(int camera, const double pixel_px[2], double distance_mm,
                                        double covariance_px2[3]) const {
    INVARIANT(camera >= 0 && camera < cameras_);
    const lens lens = lens_from_state(frame_[camera], state_.lens[camera]);
    double ray[3], point[3], in_left[3];
    if (!(distance_mm > 0) || !lens_ray(&lens, pixel_px, ray)) {
        return false;
    }
    const bool far = !std::isfinite(distance_mm);
    const double stretch = far ? 1 : distance_mm / geometry_norm(ray);
    for (int i = 0; i < 3; i++) {
        point[i] = ray[i] * stretch;
    }
    std::copy_n(point, 3, in_left);
    if (camera == RIGHT) {
        if (far) {
            geometry_rotate_back(state_.T_right_left.R, point, in_left);
        } else {
            apply(inverse(state_.T_right_left), point, in_left);
        }
    }
    std::vector<double> rows[2];
    double by_left[2][3];
    if (!pixel_rows(camera, in_left, far, rows, by_left)) {
        return false;
    }
    for (int axis = 0; axis < 2; axis++) {
        frame_row(by_left[axis], in_left, far, rows[axis].data() + FRAME_AT);
    }
    covariance_px2[0] = variance(rows[0]);
    covariance_px2[1] = covariance(rows[0], rows[1]);
    covariance_px2[2] = variance(rows[1]);
    return true;
}

bool error_model::depth_sigma(const double left_pixel_px[2], double depth_mm,
                              double *sigma_mm) const {
    const lens left = lens_from_state(frame_[LEFT], state_.lens[LEFT]);
    double point[3];
    if (cameras_ != CAMERAS || !(depth_mm > 0) || !std::isfinite(depth_mm) ||
        !lens_ray(&left, left_pixel_px, point)) {
        return false;
    }
    for (double &value : point) {
        value *= depth_mm;
    }
    // Both pixels stay where they are: 0 = J dpoint + K dshared, four equations for dpoint.
    Eigen::Matrix<double, 4, 3> J;
    std::vector<double> K[4];
    for (int camera = 0; camera < CAMERAS; camera++) {
        std::vector<double> rows[2];
        double by_left[2][3];
        if (!pixel_rows(camera, point, false, rows, by_left)) {
            return false;
        }
        for (int axis = 0; axis < 2; axis++) {
            J.row(2 * camera + axis) << by_left[axis][0], by_left[axis][1], by_left[axis][2];
            K[2 * camera + axis] = rows[axis];
        }
    }
    const Eigen::Matrix3d A = J.transpose() * J;
    const Eigen::Matrix<double, 3, 4> solve = A.ldlt().solve(J.transpose());
    std::vector<double> row(SIZE, 0.0);
    for (int i = 0; i < 4; i++) {
        for (size_t k = 0; k < row.size(); k++) {
            row[k] -= solve(2, i) * K[i][k];
        }
    }
    *sigma_mm = std::sqrt(variance(row));
    return std::isfinite(*sigma_mm);
}

}  // namespace calib

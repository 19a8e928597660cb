// SPDX-License-Identifier: Apache-2.0
#include "calib/reduced_equations.hpp"

namespace calib {

namespace {

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

}  // namespace

board_equations eliminate_board(const bundle &data, const bundle_state &state, size_t sighting) {
    board_equations result;
    square6 board = square6::Zero();
    Eigen::Matrix<double, SHARED, POSE_PLACES> mixed =
        Eigen::Matrix<double, SHARED, POSE_PLACES>::Zero();
    Eigen::Matrix<double, POSE_PLACES, 1> board_gradient =
        Eigen::Matrix<double, POSE_PLACES, 1>::Zero();
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
            const Eigen::Vector2d residual(weight * rows.residual_px[0],
                                           weight * rows.residual_px[1]);
            result.shared.noalias() += by_shared.transpose() * by_shared;
            result.gradient.noalias() += by_shared.transpose() * residual;
            mixed.noalias() += by_shared.transpose() * by_board;
            board.noalias() += by_board.transpose() * by_board;
            board_gradient.noalias() += by_board.transpose() * residual;
            result.squares += residual.squaredNorm();
            result.residuals += 2;
        }
    }
    const square6 inverse = board.ldlt().solve(square6::Identity());
    const square6 M = frame_by_board(pose);
    result.shared.noalias() -= mixed * inverse * mixed.transpose();
    result.gradient.noalias() -= mixed * (inverse * board_gradient);
    result.frame_by_shared.noalias() = -M * inverse * mixed.transpose();
    result.frame_noise.noalias() = M * inverse * M.transpose();
    return result;
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
    for (int i = 0; i < WARP_PLACES; i++) {
        if (options.free_warp[size_t(i)]) {
            places.push_back(WARP_AT + i);
        }
    }
    return places;
}

Eigen::MatrixXd picked(const Eigen::Matrix<double, SHARED, SHARED> &shared,
                       const std::vector<int> &places) {
    const long count = long(places.size());
    Eigen::MatrixXd result(count, count);
    for (long row = 0; row < count; row++) {
        for (long column = 0; column < count; column++) {
            result(row, column) = shared(places[size_t(row)], places[size_t(column)]);
        }
    }
    return result;
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd &A, bool *singular) {
    const Eigen::VectorXd scale = A.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * A * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
    const double least = 1e-13 * eigen.eigenvalues().maxCoeff();
    *singular = !(eigen.eigenvalues().minCoeff() > least);
    const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(least).cwiseInverse();
    return scale.asDiagonal() * eigen.eigenvectors() * values.asDiagonal() *
           eigen.eigenvectors().transpose() * scale.asDiagonal();
}

}  // namespace calib

// SPDX-License-Identifier: Apache-2.0
#include "calib/bundle/reduced_equations.hpp"

#include <algorithm>

#include "core/invariant.h"

namespace calib {

namespace {

// The two rows of one corner.
using shared_rows = double[2][SHARED];
using board_rows = double[2][POSE_PARAMETERS];

void spread(const corner_rows &rows, int camera, double weight, shared_rows *shared,
            board_rows *board) {
    INVARIANT(camera >= 0 && camera < CAMERAS && weight > 0);
    for (int axis = 0; axis < 2; axis++) {
        double *by_shared = (*shared)[axis];
        std::fill_n(by_shared, int(SHARED), 0.0);
        for (int i = 0; i < LENS_PARAMETERS; i++) {
            by_shared[LENS_AT + camera * LENS_PARAMETERS + i] = weight * rows.by_lens[axis][i];
        }
        for (int i = 0; i < POSE_PARAMETERS; i++) {
            by_shared[RIG_AT + i] = weight * rows.by_rig[axis][i];
            (*board)[axis][i] = weight * rows.by_board[axis][i];
        }
        for (int i = 0; i < WARP_PARAMETERS; i++) {
            by_shared[WARP_AT + i] = weight * rows.by_warp[axis][i];
        }
    }
}

// sum += a^T b
template <int A, int B>
void add_product(const double (&a)[2][A], const double (&b)[2][B], matrix *sum) {
    double *out = sum->data();
    for (int column = 0; column < B; column++) {
        for (int row = 0; row < A; row++) {
            *out++ += a[0][row] * b[0][column] + a[1][row] * b[1][column];
        }
    }
}

// Effect of a board's increment on the frame: rotation, then shift of the left frame's origin.
matrix frame_by_board(const rigid &T_left_board) {
    const double *t = T_left_board.t_mm;
    matrix M = matrix::Zero(POSE_PARAMETERS, POSE_PARAMETERS);
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

board_equations eliminate_board(const bundle &data, const bundle_state &state, size_t capture) {
    INVARIANT(data.used(capture) && state.T_left_board.size() == data.captures.size());
    board_equations result;
    matrix board = matrix::Zero(POSE_PARAMETERS, POSE_PARAMETERS);
    matrix mixed = matrix::Zero(SHARED, POSE_PARAMETERS);
    matrix board_gradient = matrix::Zero(POSE_PARAMETERS, 1);
    const rigid &pose = state.T_left_board[capture];
    for (int camera = 0; camera < data.cameras; camera++) {
        const bundle_view &view = data.captures[capture][size_t(camera)];
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
            const double residual[2][1] = {{weight * rows.residual_px[0]},
                                           {weight * rows.residual_px[1]}};
            add_product(by_shared, by_shared, &result.shared);
            add_product(by_shared, residual, &result.gradient);
            add_product(by_shared, by_board, &mixed);
            add_product(by_board, by_board, &board);
            add_product(by_board, residual, &board_gradient);
            result.squares += residual[0][0] * residual[0][0] + residual[1][0] * residual[1][0];
            result.residuals += 2;
        }
    }
    const matrix inverse = inverse_symmetric(board);
    const matrix M = frame_by_board(pose), M_inverse = product(M, inverse);
    result.shared -= carried(mixed, inverse);
    result.gradient -= product(mixed, product(inverse, board_gradient));
    result.frame_by_shared = -product(M_inverse, mixed.transpose());
    result.frame_noise = product(M_inverse, M.transpose());
    return result;
}

std::vector<int> free_places(const bundle &data, const bundle_options &options) {
    std::vector<int> parameters;
    for (int i = 0; i < data.cameras * LENS_PARAMETERS; i++) {
        if (options.free_lens[size_t(i % LENS_PARAMETERS)]) {
            parameters.push_back(LENS_AT + i);
        }
    }
    for (int i = 0; data.cameras == CAMERAS && i < POSE_PARAMETERS; i++) {
        parameters.push_back(RIG_AT + i);
    }
    for (int i = 0; i < WARP_PARAMETERS; i++) {
        if (options.free_warp[size_t(i)]) {
            parameters.push_back(WARP_AT + i);
        }
    }
    INVARIANT(!parameters.empty() && parameters.back() < SHARED);
    return parameters;
}

matrix picked(const matrix &shared, const std::vector<int> &parameters) {
    INVARIANT(shared.rows() == SHARED && shared.cols() == SHARED);
    const long count = long(parameters.size());
    matrix result(count, count);
    for (long row = 0; row < count; row++) {
        for (long column = 0; column < count; column++) {
            result(row, column) = shared(parameters[size_t(row)], parameters[size_t(column)]);
        }
    }
    return result;
}

matrix inverse_of(const matrix &A, bool *singular) {
    INVARIANT(A.rows() == A.cols() && A.rows() > 0);
    const vector scale = A.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const matrix scaled = scale.asDiagonal() * A * scale.asDiagonal();
    const eigen_system eigen = decompose_symmetric(scaled);
    const double min = 1e-13 * eigen.values.maxCoeff();
    *singular = !(eigen.values.minCoeff() > min);
    const matrix wide = scale.asDiagonal() * eigen.vectors;
    const matrix weighted = wide * eigen.values.cwiseMax(min).cwiseInverse().asDiagonal();
    return product(weighted, wide.transpose());
}

}  // namespace calib

// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/seed_pose.hpp"

#include <algorithm>
#include <cmath>

#include "calib/base/linear.hpp"
#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

const double SETTLED = 1e-8;  // relative gain of a step, over the cost, at which iteration ends

using matrix6 = Eigen::Matrix<double, POSE_PARAMETERS, POSE_PARAMETERS>;
using vector6 = Eigen::Matrix<double, POSE_PARAMETERS, 1>;

struct lens_view {
    const bundle &data;
    const both_views &views;
    const bundle_state &state;
};

// Squared residuals in standard deviations of all used corners; false when one is behind a camera.
bool squared_residuals(const lens_view &pair, const rigid &T_left_board,
                       std::vector<double> *squares) {
    squares->clear();
    for (int camera = 0; camera < pair.data.cameras; camera++) {
        const bundle_view &view = pair.views[size_t(camera)];
        for (const bundle_corner &corner : view.corners) {
            double residual[2];
            if (!view.used || !corner.used) {
                continue;
            }
            if (!corner_residual(pair.data, camera, corner, pair.state, T_left_board, residual)) {
                return false;
            }
            squares->push_back((residual[0] * residual[0] + residual[1] * residual[1]) /
                               (corner.sigma_px * corner.sigma_px));
        }
    }
    return !squares->empty();
}

double mean_loss(const std::vector<double> &squares, double scale) {
    INVARIANT(!squares.empty() && scale >= 0);
    double sum = 0;
    for (const double square : squares) {
        sum += scale > 0 ? scale * scale * std::log1p(square / (scale * scale)) : square;
    }
    return sum / double(squares.size());
}

double median_length(std::vector<double> squares) {
    INVARIANT(!squares.empty());
    std::nth_element(squares.begin(), squares.begin() + long(squares.size() / 2), squares.end());
    return std::sqrt(squares[squares.size() / 2]);
}

void normal_equations(const lens_view &pair, const rigid &T_left_board, double scale, matrix6 *A,
                      vector6 *b) {
    for (int camera = 0; camera < pair.data.cameras; camera++) {
        const bundle_view &view = pair.views[size_t(camera)];
        for (const bundle_corner &corner : view.corners) {
            corner_rows rows;
            if (!view.used || !corner.used ||
                !make_corner_rows(pair.data, camera, corner, pair.state.lens[camera], T_left_board,
                                  pair.state.T_right_left, pair.state.warp_mm, &rows)) {
                continue;
            }
            const double *x = rows.by_board[0], *y = rows.by_board[1], *r = rows.residual_px;
            const double inverse = 1 / (corner.sigma_px * corner.sigma_px);
            const double square = inverse * (r[0] * r[0] + r[1] * r[1]);
            const double weight = inverse / (scale > 0 ? 1 + square / (scale * scale) : 1);
            for (int column = 0; column < POSE_PARAMETERS; column++) {
                for (int row = 0; row < POSE_PARAMETERS; row++) {
                    (*A)(row, column) += weight * x[row] * x[column] + weight * y[row] * y[column];
                }
                (*b)(column) -= weight * x[column] * r[0] + weight * y[column] * r[1];
            }
        }
    }
}

// One Levenberg-Marquardt step: raises `*damping` until the cost falls. Returns true when there is
// nothing left to gain, and the iteration ends.
bool improve_pose(const lens_view &pair, double scale, rigid *pose, std::vector<double> *squares,
                  double *damping) {
    const double cost = mean_loss(*squares, scale);
    INVARIANT(*damping > 0 && pose->t_mm[2] > 0);
    matrix6 A = matrix6::Zero();
    vector6 b = vector6::Zero();
    normal_equations(pair, *pose, scale, &A, &b);
    std::vector<double> tried_squares;
    bool settled = false, better = false;
    while (!settled && !better && *damping < 1e8) {
        matrix6 damped = A;
        damped.diagonal() *= 1 + *damping;
        const vector6 step = solve_symmetric(damped, b);
        const rigid tried = moved_board(*pose, step.data());
        // The predicted gain of the step, as a share of the whole.
        settled = !(step.dot(b) > SETTLED * cost * double(squares->size()));
        better = step.allFinite() && step.norm() < 10 &&
                 squared_residuals(pair, tried, &tried_squares) &&
                 mean_loss(tried_squares, scale) < cost;
        if (better) {
            *pose = tried;
            squares->swap(tried_squares);
            *damping = std::max(1e-9, 0.1 * *damping);
        } else {
            *damping = std::max(1e-6, 10 * *damping);
        }
    }
    return settled;
}

}  // namespace

double fit_pose(const bundle &data, const both_views &views, const bundle_state &state,
                double loss_scale, rigid *T_left_board) {
    const lens_view pair{data, views, state};
    rigid pose = *T_left_board;
    std::vector<double> squares;
    if (!(pose.t_mm[2] > 0) || !squared_residuals(pair, pose, &squares)) {
        return -1;
    }
    double damping = 1e-6;
    for (int iteration = 0; iteration < 40 && damping < 1e8; iteration++) {
        const double scale =
            loss_scale > 0 ? std::max(loss_scale, 1.5 * median_length(squares)) : 0;
        if (improve_pose(pair, scale, &pose, &squares, &damping)) {
            break;
        }
    }
    orthonormalise(pose.R);
    *T_left_board = pose;
    return mean_loss(squares, loss_scale);
}

rigid second_pose(const rigid &T_camera_board) {
    // From afar only the components of the board's x and y axes perpendicular to the line of sight
    // s are visible. Their components along s change sign: both axes are mirrored at the plane
    // perpendicular to s. That makes them left-handed with the mirrored normal, so its sign
    // changes, too.
    const double *t = T_camera_board.t_mm;
    const double length = geometry_norm(t);
    INVARIANT(length > 0);
    const double s[3] = {t[0] / length, t[1] / length, t[2] / length};
    double along[3];  // s . each axis of the board
    geometry_rotate_back(T_camera_board.R, s, along);
    rigid result = T_camera_board;
    for (int row = 0; row < 3; row++) {
        for (int axis = 0; axis < 3; axis++) {
            double &value = result.R[3 * row + axis];
            value = (axis == 2 ? -1 : 1) * (value - 2 * s[row] * along[axis]);
        }
    }
    return result;
}

double fit_pose_either_way(const bundle &data, const both_views &views, const bundle_state &state,
                           double loss_scale, rigid *T_left_board) {
    rigid first = *T_left_board, second = second_pose(*T_left_board);
    const double first_cost = fit_pose(data, views, state, loss_scale, &first);
    const double second_cost = fit_pose(data, views, state, loss_scale, &second);
    if (first_cost < 0 && second_cost < 0) {
        return -1;
    }
    const bool take_second = first_cost < 0 || (second_cost >= 0 && second_cost < first_cost);
    *T_left_board = take_second ? second : first;
    return take_second ? second_cost : first_cost;
}

}  // namespace calib

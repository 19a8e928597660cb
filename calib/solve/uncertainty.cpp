// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/uncertainty.hpp"

#include <algorithm>
#include <cmath>

#include "calib/base/linear.hpp"
#include "calib/bundle/board_scatter.hpp"
#include "calib/bundle/reduced_equations.hpp"
#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

enum {
    FRAME_AT = SHARED,  // rotation and shift of the boards' frame
    SIZE = SHARED + POSE_PARAMETERS,
};

void add(const board_equations &board, board_equations *sum) {
    sum->shared += board.shared;
    sum->gradient += board.gradient;
    sum->frame_by_shared += board.frame_by_shared;
    sum->frame_noise += board.frame_noise;
    sum->squares += board.squares;
    sum->residuals += board.residuals;
}

// How the shared parameters and the boards' frame depend on those of `parameters`.
matrix follow_of(const board_equations &sum, const std::vector<int> &parameters, long board_count) {
    INVARIANT(board_count > 0 && !parameters.empty());
    matrix follow = matrix::Zero(SIZE, long(parameters.size()));
    for (long column = 0; column < follow.cols(); column++) {
        follow(parameters[size_t(column)], column) = 1;
        follow.col(column).tail<POSE_PARAMETERS>() =
            sum.frame_by_shared.col(parameters[size_t(column)]) / double(board_count);
    }
    return follow;
}

// Prior standard deviation of p1 and p2, as a share of the reference radius: lenses of webcams and
// zooms are off axis by about this much.
const double TANGENTIAL_SHARE = 1e-3;

// What p1 and p2 add to `estimated`, the covariance of the shared parameters and of the boards'
// frame in squared sigmas, when the model omits them. Views from far away hardly distinguish them
// from a shift of the principal point, so they may exist undetected. Where the views indicate them,
// the step that the solution would make with them counts as an error, too.
matrix doubt_of(const bundle &data, const bundle_options &options, const board_equations &sum,
                long board_count, double variance, const matrix &estimated) {
    matrix shared = sum.shared;
    bundle_options doubting = options;
    for (const int parameter : {TANGENTIAL_1, TANGENTIAL_2}) {
        doubting.free_lens[size_t(parameter)] = true;
        for (int camera = 0; camera < data.cameras; camera++) {
            const int at = LENS_AT + camera * LENS_PARAMETERS + parameter;
            const double expected_px = TANGENTIAL_SHARE * data.frame[camera].radius_px;
            shared(at, at) += variance / (expected_px * expected_px);
        }
    }
    if (doubting.free_lens == options.free_lens) {
        return matrix::Zero(SIZE, SIZE);
    }
    const std::vector<int> parameters = free_places(data, doubting);
    bool singular = false;  // the prior of p1 and p2 is known: the rest is reused
    const matrix inverse = inverse_of(picked(shared, parameters), &singular);
    matrix gradient(long(parameters.size()), 1);
    for (long row = 0; row < gradient.rows(); row++) {
        gradient(row, 0) = sum.gradient(parameters[size_t(row)], 0);
    }
    const matrix step = product(inverse, gradient);
    const matrix follow = follow_of(sum, parameters, board_count);
    return carried(follow, variance * inverse + product(step, step.transpose())) -
           variance * estimated;
}

// The ray of a pixel at z = 1; false if the lens sees no such ray there.
bool ray_per_depth(const lens &lens, const double pixel_px[2], double ray[3]) {
    return lens_ray(&lens, pixel_px, ray) && ray[2] == 1;
}

// Rotation and shift of the frame move a point: by_left of a pixel becomes its row by the frame.
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
    INVARIANT(cameras_ == 1 || cameras_ == CAMERAS);
    INVARIANT(state.T_left_board.size() == data.captures.size());
    std::vector<board_equations> boards;
    board_equations sum;
    for (size_t i = 0; i < data.captures.size(); i++) {
        if (data.used(i)) {
            boards.push_back(eliminate_board(data, state, i));
            add(boards.back(), &sum);
        }
    }
    const std::vector<int> parameters = free_places(data, options);
    const long count = long(parameters.size()), board_count = std::max(1L, long(boards.size()));
    const long freedom = sum.residuals - count - long(POSE_PARAMETERS) * board_count;
    sigma0_ = std::sqrt(sum.squares / double(std::max(1L, freedom)));
    const double variance = sigma0_ * sigma0_;
    const matrix follow = follow_of(sum, parameters, board_count);
    const matrix estimated =
        carried(follow, inverse_of(picked(sum.shared, parameters), &singular_));
    singular_ = singular_ || freedom < 1;
    const matrix doubt = doubt_of(data, options, sum, board_count, variance, estimated);
    Eigen::Map<matrix> result(covariance_.data(), SIZE, SIZE);
    result = estimated;
    result.bottomRightCorner<POSE_PARAMETERS, POSE_PARAMETERS>() +=
        sum.frame_noise / double(board_count * board_count);
    result = variance * result + doubt;
    if (!singular_) {
        const board_scatter scatter = scatter_of(boards, parameters, sigma0_);
        scatter_z_ = scatter.z;
        scatter_ratio_ = std::max(1.0, scatter.ratio);
        INVARIANT(scatter.covariance.rows() == count && scatter.covariance.cols() == count);
        const matrix seen = carried(follow, scatter.covariance) + doubt;
        scattered_.assign(seen.data(), seen.data() + SIZE * SIZE);
    }
}

void error_model::use_scatter() {
    INVARIANT(scatter_ratio_ >= 1 && scattered_.size() == covariance_.size());
    for (size_t i = 0; i < covariance_.size(); i++) {
        covariance_[i] = 0.5 * (scatter_ratio_ * covariance_[i] + scattered_[i]);
    }
}

void error_model::widen(double factor) {
    INVARIANT(factor >= 1);
    for (double &value : covariance_) {
        value *= factor * factor;
    }
}

void error_model::doubt_scale(double share) {
    INVARIANT(share >= 0);
    const double *t = state_.T_right_left.t_mm;
    for (size_t i = 0; i < 3; i++) {
        for (size_t k = 0; k < 3; k++) {
            covariance_[(RIG_AT + 3 + i) * SIZE + RIG_AT + 3 + k] += share * share * t[i] * t[k];
        }
    }
}

double error_model::covariance(const std::vector<double> &a, const std::vector<double> &b) const {
    INVARIANT(a.size() == SIZE && b.size() == SIZE);
    double sum = 0;
    for (size_t row = 0; row < SIZE; row++) {
        double with_b = 0;  // a column of C, which is also its row
        for (size_t column = 0; column < SIZE; column++) {
            with_b += covariance_[row * SIZE + column] * b[column];
        }
        sum += a[row] * with_b;
    }
    return sum;
}

double error_model::variance(const std::vector<double> &row) const {
    return std::max(0.0, covariance(row, row));
}

double error_model::lens_sigma(int camera, int parameter) const {
    INVARIANT(camera >= 0 && camera < cameras_);
    INVARIANT(parameter >= 0 && parameter < LENS_PARAMETERS);
    std::vector<double> row(SIZE, 0.0);
    row[size_t(LENS_AT + camera * LENS_PARAMETERS + parameter)] = 1;
    return std::sqrt(variance(row));
}

double error_model::rig_sigma(int parameter) const {
    INVARIANT(cameras_ == CAMERAS && parameter >= 0 && parameter < POSE_PARAMETERS);
    std::vector<double> row(SIZE, 0.0);
    row[size_t(RIG_AT + parameter)] = 1;
    return std::sqrt(variance(row));
}

double error_model::baseline_sigma_mm() const {
    INVARIANT(cameras_ == CAMERAS);
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
        std::copy_n(seen.by_lens[axis], int(LENS_PARAMETERS),
                    rows[axis].begin() + LENS_AT + camera * LENS_PARAMETERS);
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

bool error_model::point_rows(const double in_left_mm[3], std::vector<double> (&rows)[3]) const {
    // Both pixels stay fixed: 0 = J dpoint + K dshared, four equations for dpoint.
    vector3 J[4];
    std::vector<double> K[4];
    for (int camera = 0; camera < CAMERAS; camera++) {
        std::vector<double> of_pixel[2];
        double by_left[2][3];
        if (!pixel_rows(camera, in_left_mm, false, of_pixel, by_left)) {
            return false;
        }
        for (int axis = 0; axis < 2; axis++) {
            J[2 * camera + axis] = {by_left[axis][0], by_left[axis][1], by_left[axis][2]};
            K[2 * camera + axis] = of_pixel[axis];
        }
    }
    matrix3 A = matrix3::Zero();
    for (const vector3 &of_row : J) {
        A += of_row * of_row.transpose();
    }
    for (int axis = 0; axis < 3; axis++) {
        const vector3 by = solve_symmetric(A, vector3::Unit(axis));
        rows[axis].assign(SIZE, 0.0);
        for (int i = 0; i < 4; i++) {
            const double weight = by.dot(J[i]);
            for (size_t k = 0; k < rows[axis].size(); k++) {
                rows[axis][k] -= weight * K[i][k];
            }
        }
    }
    return true;
}

bool error_model::depth_sigma(const double left_pixel_px[2], double depth_mm,
                              double *sigma_mm) const {
    const lens left = lens_from_state(frame_[LEFT], state_.lens[LEFT]);
    double point[3];
    std::vector<double> rows[3];
    if (cameras_ != CAMERAS || !(depth_mm > 0) || !std::isfinite(depth_mm) ||
        !ray_per_depth(left, left_pixel_px, point)) {
        return false;
    }
    for (double &value : point) {
        value *= depth_mm;
    }
    if (!point_rows(point, rows)) {
        return false;
    }
    *sigma_mm = std::sqrt(variance(rows[2]));
    return std::isfinite(*sigma_mm);
}

bool error_model::length_sigma(const double first_mm[3], const double second_mm[3],
                               double *sigma_mm) const {
    std::vector<double> first[3], second[3], row(SIZE, 0.0);
    const double apart[3] = {second_mm[0] - first_mm[0], second_mm[1] - first_mm[1],
                             second_mm[2] - first_mm[2]};
    const double length_mm = geometry_norm(apart);
    if (cameras_ != CAMERAS || !(length_mm > 0) || !point_rows(first_mm, first) ||
        !point_rows(second_mm, second)) {
        return false;
    }
    for (int axis = 0; axis < 3; axis++) {
        for (size_t k = 0; k < row.size(); k++) {
            row[k] += apart[axis] / length_mm * (second[axis][k] - first[axis][k]);
        }
    }
    *sigma_mm = std::sqrt(variance(row));
    return std::isfinite(*sigma_mm);
}

}  // namespace calib

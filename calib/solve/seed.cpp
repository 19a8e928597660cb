// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/seed.hpp"

#include <algorithm>
#include <cmath>

#include "calib/base/linear.hpp"
#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

using row_major3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

struct match {
    double x_mm, y_mm, x_px, y_px, weight;
};

// Moves the weighted centroid of points to 0 and their mean distance to about 1.
struct normalisation {
    double x = 0, y = 0, scale = 1;

    matrix3 matrix() const {
        matrix3 result;
        result << scale, 0, -scale * x, 0, scale, -scale * y, 0, 0, 1;
        return result;
    }
    matrix3 inverse() const {
        matrix3 result;
        result << 1 / scale, 0, x, 0, 1 / scale, y, 0, 0, 1;
        return result;
    }
};

template <typename GetX, typename GetY>
normalisation normalise(const std::vector<match> &matches, GetX get_x, GetY get_y) {
    normalisation result;
    double weights = 0, square = 0;
    for (const match &one : matches) {
        weights += one.weight;
        result.x += one.weight * get_x(one);
        result.y += one.weight * get_y(one);
    }
    result.x /= weights;
    result.y /= weights;
    for (const match &one : matches) {
        const double x = get_x(one) - result.x, y = get_y(one) - result.y;
        square += one.weight * (x * x + y * y);
    }
    result.scale = std::sqrt(weights / std::max(square, 1e-300));
    return result;
}

matrix3 weighted_dlt(const std::vector<match> &matches) {
    INVARIANT(matches.size() >= 4);
    const normalisation board = normalise(
        matches, [](const match &m) { return m.x_mm; }, [](const match &m) { return m.y_mm; });
    const normalisation image = normalise(
        matches, [](const match &m) { return m.x_px; }, [](const match &m) { return m.y_px; });
    matrix A = matrix::Zero(9, 9);
    for (const match &one : matches) {
        const double x = board.scale * (one.x_mm - board.x), y = board.scale * (one.y_mm - board.y);
        const double u = image.scale * (one.x_px - image.x), v = image.scale * (one.y_px - image.y);
        const double rows[2][9] = {{x, y, 1, 0, 0, 0, -u * x, -u * y, -u},
                                   {0, 0, 0, x, y, 1, -v * x, -v * y, -v}};
        for (int column = 0; column < 9; column++) {
            for (int row = 0; row < 9; row++) {
                A(row, column) += one.weight * rows[0][row] * rows[0][column] +
                                  one.weight * rows[1][row] * rows[1][column];
            }
        }
    }
    const vector h = decompose_symmetric(A).vectors.col(0);
    matrix3 H;
    H << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), h(8);
    return image.inverse() * H * board.matrix();
}

double distance_px(const matrix3 &H, const match &one) {
    const vector3 seen = H * vector3(one.x_mm, one.y_mm, 1);
    return std::hypot(seen.x() / seen.z() - one.x_px, seen.y() / seen.z() - one.y_px);
}

double median(std::vector<double> values) {
    INVARIANT(!values.empty());
    std::nth_element(values.begin(), values.begin() + long(values.size() / 2), values.end());
    return values[values.size() / 2];
}

double extent_px(const std::vector<match> &matches) {
    INVARIANT(!matches.empty());
    double x = 0, y = 0, square = 0;
    for (const match &one : matches) {
        x += one.x_px / double(matches.size());
        y += one.y_px / double(matches.size());
    }
    for (const match &one : matches) {
        square += (one.x_px - x) * (one.x_px - x) + (one.y_px - y) * (one.y_px - y);
    }
    return std::sqrt(square / double(matches.size()));
}

}  // namespace

bool fit_homography(const bundle &data, const bundle_view &view, homography *result) {
    bundle_view all = view;
    for (bundle_corner &corner : all.corners) {
        corner.used = true;
    }
    if (!spans_area(data, all, 4)) {
        return false;
    }
    std::vector<match> matches;
    for (const bundle_corner &corner : view.corners) {
        const board_point &point = data.points[size_t(corner.index)];
        matches.push_back({point.x_mm, point.y_mm, corner.x_px, corner.y_px, 1});
    }
    matrix3 H = weighted_dlt(matches);
    std::vector<double> distances(matches.size());
    for (int round = 0; round < 8; round++) {
        for (size_t i = 0; i < matches.size(); i++) {
            distances[i] = distance_px(H, matches[i]);
        }
        const double scale = std::max(2 * median(distances), 1e-6);
        for (size_t i = 0; i < matches.size(); i++) {
            const double ratio = distances[i] / scale;
            matches[i].weight = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
        }
        H = weighted_dlt(matches);
    }
    for (size_t i = 0; i < matches.size(); i++) {
        distances[i] = distance_px(H, matches[i]);
    }
    result->misfit_px = median(distances);
    result->extent_px = extent_px(matches);
    result->low_mm[0] = result->high_mm[0] = matches[0].x_mm;
    result->low_mm[1] = result->high_mm[1] = matches[0].y_mm;
    for (const match &one : matches) {
        result->low_mm[0] = std::min(result->low_mm[0], one.x_mm);
        result->low_mm[1] = std::min(result->low_mm[1], one.y_mm);
        result->high_mm[0] = std::max(result->high_mm[0], one.x_mm);
        result->high_mm[1] = std::max(result->high_mm[1], one.y_mm);
    }
    // Seen from the front, x to y turns the same way on the board and in the image: det > 0 where
    // the board's middle has a positive third coordinate.
    H /= H(2, 2);
    Eigen::Map<row_major3>(result->H) = H;
    double across[3];
    geometry_cross(&result->H[0], &result->H[3], across);
    result->mirrored = !(geometry_dot(across, &result->H[6]) > 0);
    return H.allFinite();
}

bool fit_flat_homography(const bundle &data, int camera, const bundle_view &view,
                         const lens_state &lens, homography *result) {
    static const double tangent_max = 5.67;  // tangent of 80 degrees
    const struct lens bent = lens_from_state(data.frame[camera], lens);
    bundle_view flat = view;
    flat.corners.clear();
    for (bundle_corner corner : view.corners) {
        const double pixel_px[2] = {corner.x_px, corner.y_px};
        double ray[3];
        if (lens_ray(&bent, pixel_px, ray) && ray[2] > 0 &&
            std::hypot(ray[0], ray[1]) < tangent_max * ray[2]) {
            corner.x_px = bent.cx_px + bent.fx_px * ray[0] / ray[2];
            corner.y_px = bent.cy_px + bent.fx_px * ray[1] / ray[2];
            flat.corners.push_back(corner);
        }
    }
    return !flat.corners.empty() && fit_homography(data, flat, result);
}

bool pose_from_homography(const homography &seen, double focal_px, double centre_x_px,
                          double centre_y_px, rigid *T_camera_board) {
    INVARIANT(focal_px > 0);
    const Eigen::Map<const row_major3> H(seen.H);
    matrix3 M = H;
    M.row(0) -= centre_x_px * H.row(2);
    M.row(1) -= centre_y_px * H.row(2);
    M.topRows(2) /= focal_px;
    const double scale = 0.5 * (M.col(0).norm() + M.col(1).norm());
    if (!(scale > 0)) {
        return false;
    }
    M /= M(2, 2) > 0 ? scale : -scale;
    rigid pose;
    double across[3];
    geometry_cross(M.col(0).data(), M.col(1).data(), across);
    Eigen::Map<row_major3> R(pose.R);
    R << M.col(0), M.col(1), Eigen::Map<const vector3>(across);
    if (!R.allFinite()) {
        return false;
    }
    orthonormalise(pose.R);
    for (int i = 0; i < 3; i++) {
        pose.t_mm[i] = M(i, 2);
    }
    *T_camera_board = pose;
    return pose.t_mm[2] > 0;
}

}  // namespace calib

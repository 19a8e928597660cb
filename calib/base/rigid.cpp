// SPDX-License-Identifier: Apache-2.0
#include "calib/base/rigid.hpp"

#include <algorithm>
#include <cmath>

#include "calib/base/linear.hpp"
#include "stereo/geometry/geometry.h"

namespace calib {

rigid operator*(const rigid &T_AB, const rigid &T_BC) {
    rigid result;
    geometry_multiply(T_AB.R, T_BC.R, result.R);
    apply(T_AB, T_BC.t_mm, result.t_mm);
    return result;
}

rigid inverse(const rigid &T_AB) {
    rigid result;
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) {
            result.R[3 * row + column] = T_AB.R[3 * column + row];
        }
    }
    geometry_rotate_back(T_AB.R, T_AB.t_mm, result.t_mm);
    for (double &value : result.t_mm) {
        value = -value;
    }
    return result;
}

void apply(const rigid &T_AB, const double point_mm[3], double result_mm[3]) {
    geometry_rotate(T_AB.R, point_mm, result_mm);
    for (int i = 0; i < 3; i++) {
        result_mm[i] += T_AB.t_mm[i];
    }
}

rigid turned(const rigid &T_AB, const double turn_rad[3]) {
    double turn[9];
    geometry_rotation_from_vector(turn_rad, turn);
    rigid result = T_AB;
    geometry_multiply(turn, T_AB.R, result.R);
    return result;
}

double turn_between_rad(const rigid &first, const rigid &second) {
    // |A - B| (Frobenius) is 2 sqrt(2) sin(angle / 2), which is also exact for small angles.
    double sum2 = 0;
    for (int i = 0; i < 9; i++) {
        sum2 += (first.R[i] - second.R[i]) * (first.R[i] - second.R[i]);
    }
    return 2 * std::asin(std::min(1.0, std::sqrt(sum2 / 8)));
}

void left_jacobian(const double turn_rad[3], double J[9]) {
    const double x = turn_rad[0], y = turn_rad[1], z = turn_rad[2];
    const double angle2 = x * x + y * y + z * z, angle = std::sqrt(angle2);
    double a, b;  // (1 - cos) / angle^2, (angle - sin) / angle^3
    if (angle < 1e-3) {
        a = 0.5 - angle2 / 24;
        b = 1.0 / 6 - angle2 / 120;
    } else {
        a = (1 - std::cos(angle)) / angle2;
        b = (angle - std::sin(angle)) / (angle2 * angle);
    }
    const double cross[9] = {0, -z, y, z, 0, -x, -y, x, 0};
    double square[9];
    geometry_multiply(cross, cross, square);
    for (int i = 0; i < 9; i++) {
        J[i] = (i % 4 == 0) + a * cross[i] + b * square[i];
    }
}

void orthonormalise(double R[9]) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rows(R);
    rows = nearest_rotation(rows);
}

}  // namespace calib

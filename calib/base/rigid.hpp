// SPDX-License-Identifier: Apache-2.0
/// Rigid motions between frames.
#ifndef VERGENCE_CALIB_BASE_RIGID_HPP
#define VERGENCE_CALIB_BASE_RIGID_HPP

namespace calib {

/// T_AB: point_a = R point_b + t. `R` is row-major.
struct rigid {
    double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double t_mm[3] = {0, 0, 0};
};

/// T_AC = T_AB T_BC.
rigid operator*(const rigid &T_AB, const rigid &T_BC);
rigid inverse(const rigid &T_AB);

/// result = R point + t. `result` must not overlap `point_mm`.
void apply(const rigid &T_AB, const double point_mm[3], double result_mm[3]);

/// Rotates T_AB by a rotation vector given in A, about A's axes: R becomes exp(turn) R, t is
/// unchanged.
rigid turned(const rigid &T_AB, const double turn_rad[3]);

/// Angle in rad of the rotation between the two.
double turn_between_rad(const rigid &first, const rigid &second);

/// The matrix J of d(exp(w) v) = -[exp(w) v]x J dw, row-major (the left Jacobian of SO(3)).
/// Source: J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory", 2018, equation 145.
void left_jacobian(const double turn_rad[3], double J[9]);

/// Makes `R` exactly orthonormal again (nearest rotation by polar decomposition).
void orthonormalise(double R[9]);

}  // namespace calib

#endif

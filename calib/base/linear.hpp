// SPDX-License-Identifier: Apache-2.0
/// Eigen's decompositions and products for the calibration. A compiler needs seconds for each of
/// them, for every size and wherever it is used: here they are compiled once, for any size.
#ifndef VERGENCE_CALIB_BASE_LINEAR_HPP
#define VERGENCE_CALIB_BASE_LINEAR_HPP

#include <Eigen/Core>

namespace calib {

using matrix = Eigen::MatrixXd;
using vector = Eigen::VectorXd;
using matrix3 = Eigen::Matrix3d;
using vector3 = Eigen::Vector3d;

/// A B, and A B A^T.
matrix product(const matrix &A, const matrix &B);
matrix carried(const matrix &A, const matrix &B);

/// x of A x = b, and the inverse of A, where A is symmetric and not negative, as normal equations
/// are. Directions that a singular A says nothing of stay 0.
vector solve_symmetric(const matrix &A, const vector &b);
matrix inverse_symmetric(const matrix &A);

/// x of A x = b, and the inverse of A, for any square A; not finite where A is singular.
vector solve_square(const matrix &A, const vector &b);
matrix inverse_square(const matrix &A);

/// Eigenvalues, ascending, and eigenvectors (columns, of length 1) of a symmetric matrix.
struct eigen_system {
    vector values;
    matrix vectors;
};
eigen_system decompose_symmetric(const matrix &A);

/// The rotation nearest to A, and the matrix of rank 2 nearest to A, in the sum of squares.
matrix3 nearest_rotation(const matrix3 &A);
matrix3 nearest_of_rank_2(const matrix3 &A);

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
#include "calib/base/linear.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "core/invariant.h"

namespace calib {

matrix product(const matrix &A, const matrix &B) {
    INVARIANT(A.cols() == B.rows());
    return A * B;
}

matrix carried(const matrix &A, const matrix &B) {
    INVARIANT(B.rows() == B.cols());
    return product(product(A, B), A.transpose());
}

vector solve_symmetric(const matrix &A, const vector &b) {
    INVARIANT(A.rows() == A.cols() && A.rows() == b.size());
    return A.ldlt().solve(b);
}

matrix inverse_symmetric(const matrix &A) {
    INVARIANT(A.rows() == A.cols());
    return A.ldlt().solve(matrix::Identity(A.rows(), A.cols()));
}

vector solve_square(const matrix &A, const vector &b) {
    INVARIANT(A.rows() == A.cols() && A.rows() == b.size());
    return A.partialPivLu().solve(b);
}

matrix inverse_square(const matrix &A) {
    INVARIANT(A.rows() == A.cols());
    return A.partialPivLu().inverse();
}

eigen_system decompose_symmetric(const matrix &A) {
    INVARIANT(A.rows() == A.cols() && A.rows() > 0);
    const Eigen::SelfAdjointEigenSolver<matrix> solver(A);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

matrix3 nearest_rotation(const matrix3 &A) {
    const Eigen::JacobiSVD<matrix3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    matrix3 U = svd.matrixU();
    if ((U * svd.matrixV().transpose()).determinant() < 0) {
        U.col(2) *= -1;
    }
    return U * svd.matrixV().transpose();
}

matrix3 nearest_of_rank_2(const matrix3 &A) {
    const Eigen::JacobiSVD<matrix3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    vector3 values = svd.singularValues();
    values[2] = 0;
    return svd.matrixU() * values.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace calib

// SPDX-License-Identifier: Apache-2.0
/// Cholesky's factors of symmetric matrices that may be singular, n x n by rows.
#ifndef VERGENCE_CORE_CHOLESKY_H
#define VERGENCE_CORE_CHOLESKY_H

#ifdef __cplusplus
extern "C" {
#endif

/// Replaces a matrix, of which the lower triangle counts, by L with matrix = L L^T. A pivot of no
/// more than `tolerance` of its diagonal element, a direction without variance of its own, makes an
/// empty column.
void cholesky_factorize(double *matrix, int n, double tolerance);

/// Solves L x = b, in place; elements of b are `stride` apart. x is 0 for empty columns.
void cholesky_forward(const double *L, int n, double *b, int stride);

/// Solves L^T x = b, in place. x is 0 for empty columns.
void cholesky_backward(const double *L, int n, double *b);

#ifdef __cplusplus
}
#endif

#endif

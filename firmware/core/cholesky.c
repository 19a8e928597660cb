// SPDX-License-Identifier: Apache-2.0
#include "core/cholesky.h"

#include <math.h>

#include "core/invariant.h"

void cholesky_factorize(double *matrix, int n, double tolerance) {
    INVARIANT(n >= 0 && tolerance >= 0 && tolerance < 1);
    for (int j = 0; j < n; j++) {
        const double before = matrix[j * n + j];
        double rest = before;
        for (int k = 0; k < j; k++) {
            rest -= matrix[j * n + k] * matrix[j * n + k];
        }
        const double pivot = rest > tolerance * before && before > 0 ? sqrt(rest) : 0;
        matrix[j * n + j] = pivot;
        for (int i = j + 1; i < n; i++) {
            double value = matrix[i * n + j];
            for (int k = 0; k < j; k++) {
                value -= matrix[i * n + k] * matrix[j * n + k];
            }
            matrix[i * n + j] = pivot > 0 ? value / pivot : 0;
            matrix[j * n + i] = 0;
        }
    }
}

void cholesky_forward(const double *L, int n, double *b, int stride) {
    INVARIANT(n >= 0 && stride > 0);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++) {
            b[i * stride] -= L[i * n + k] * b[k * stride];
        }
        b[i * stride] = L[i * n + i] > 0 ? b[i * stride] / L[i * n + i] : 0;
    }
}

void cholesky_backward(const double *L, int n, double *b) {
    INVARIANT(n >= 0);
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) {
            b[i] -= L[k * n + i] * b[k];
        }
        b[i] = L[i * n + i] > 0 ? b[i] / L[i * n + i] : 0;
    }
}

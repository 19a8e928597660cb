// SPDX-License-Identifier: Apache-2.0
#include "calib/bundle/board_scatter.hpp"

#include <cmath>

#include "core/invariant.h"

namespace calib {

namespace {

double trace_of_product(const matrix &A, const matrix &B) {
    INVARIANT(A.cols() == B.rows() && A.rows() == B.cols());
    double sum = 0;
    for (long column = 0; column < A.cols(); column++) {
        for (long row = 0; row < A.rows(); row++) {
            sum += A(row, column) * B(column, row);
        }
    }
    return sum;
}

}  // namespace

board_scatter scatter_of(const std::vector<board_equations> &boards,
                         const std::vector<int> &parameters, double sigma0) {
    INVARIANT(!parameters.empty() && !(sigma0 < 0));
    const long count = long(parameters.size());
    const double variance = sigma0 * sigma0;
    matrix all = matrix::Zero(count, count);
    for (const board_equations &board : boards) {
        all += picked(board.shared, parameters);
    }
    bool singular = false;
    const matrix inverse = inverse_of(all, &singular);
    const board_scatter unknown = {1, 0, variance * inverse};
    if (singular || boards.size() < 4 || !(variance > 0)) {
        return unknown;
    }
    matrix seen = matrix::Zero(count, count);
    double expected = 0, expected_variance = 0;
    for (const board_equations &board : boards) {
        const matrix own = picked(board.shared, parameters);
        matrix gradient(count, 1);
        for (long i = 0; i < count; i++) {
            gradient(i, 0) = board.gradient(parameters[size_t(i)], 0);
        }
        const matrix without = inverse_of(all - own, &singular);
        if (singular) {
            return unknown;
        }
        const matrix moved = product(without, gradient);
        seen += product(moved, moved.transpose());
        // The gradient at the solution is noise of covariance own - own all^-1 own.
        const matrix noise = own - carried(own, inverse);
        const matrix spread = product(carried(without, noise), all);
        expected += spread.trace();
        expected_variance += 2 * trace_of_product(spread, spread);
    }
    board_scatter result;
    result.ratio = trace_of_product(all, seen) / (variance * expected);
    result.covariance = seen * (double(count) / expected);
    // Wilson-Hilferty transformation of a chi-square whose degrees of freedom follow from the
    // variance.
    const double freedom = 2 * expected * expected / expected_variance;
    const double bend = 2 / (9 * freedom);
    result.z = (std::cbrt(result.ratio) - (1 - bend)) / std::sqrt(bend);
    return result;
}

}  // namespace calib

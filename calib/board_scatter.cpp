// SPDX-License-Identifier: Apache-2.0
#include "calib/board_scatter.hpp"

#include <cmath>

namespace calib {

board_scatter scatter_of(const std::vector<board_equations> &boards, const std::vector<int> &places,
                         double sigma0) {
    const long count = long(places.size());
    const double variance = sigma0 * sigma0;
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(count, count);
    for (const board_equations &board : boards) {
        all += picked(board.shared, places);
    }
    bool singular = false;
    const Eigen::MatrixXd inverse = inverse_of(all, &singular);
    const board_scatter unknown = {1, 0, variance * inverse};
    if (singular || boards.size() < 4 || !(variance > 0)) {
        return unknown;
    }
    Eigen::MatrixXd seen = Eigen::MatrixXd::Zero(count, count);
    double expected = 0, expected_variance = 0;
    for (const board_equations &board : boards) {
        const Eigen::MatrixXd own = picked(board.shared, places);
        Eigen::VectorXd gradient(count);
        for (long i = 0; i < count; i++) {
            gradient[i] = board.gradient[places[size_t(i)]];
        }
        const Eigen::MatrixXd without = inverse_of(all - own, &singular);
        if (singular) {
            return unknown;
        }
        const Eigen::VectorXd moved = without * gradient;
        seen += moved * moved.transpose();
        // The gradient at the solution is noise of covariance own - own all^-1 own.
        const Eigen::MatrixXd spread = without * (own - own * inverse * own) * without * all;
        expected += spread.trace();
        expected_variance += 2 * (spread * spread).trace();
    }
    board_scatter result;
    result.ratio = (all * seen).trace() / (variance * expected);
    result.covariance = seen * (double(count) / expected);
    // Wilson and Hilferty, for a chi-square of as much freedom as the variance tells.
    const double freedom = 2 * expected * expected / expected_variance;
    const double bend = 2 / (9 * freedom);
    result.z = (std::cbrt(result.ratio) - (1 - bend)) / std::sqrt(bend);
    return result;
}

}  // namespace calib

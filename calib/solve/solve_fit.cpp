// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/solve_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/invariant.h"

namespace calib {

namespace {

const int CELLS_ACROSS = 8, CELLS_DOWN = 6;
const int MIN_IN_CELL = 4;
const double ALARM_Z = 5;
const double MIN_PATTERN_PX = 1e-3;  // rounding also leaves patterns

struct cell {
    double x = 0, y = 0;  // sums of residuals, in sigmas
    int count = 0;
};

struct pattern {
    double z = 0;
    double excess = 0;  // mean square in sigmas, per corner, beyond expected noise
    double ratio = 1;   // chi-square over its degrees of freedom
};

pattern find_pattern(const std::vector<cell> &cells) {
    double chi2 = 0;
    int freedom = 0, corners = 0;
    for (const cell &one : cells) {
        if (one.count >= MIN_IN_CELL) {
            chi2 += (one.x * one.x + one.y * one.y) / one.count;
            freedom += 2;
            corners += one.count;
        }
    }
    if (freedom == 0) {
        return {};
    }
    // Wilson-Hilferty: the cube root of chi2 / freedom is nearly gaussian. The fitted parameters
    // make chi2 smaller than its nominal freedom, so the test errs towards no alarm.
    const double spread = 2.0 / (9.0 * freedom);
    return {(std::cbrt(chi2 / freedom) - (1 - spread)) / std::sqrt(spread),
            std::max(0.0, (chi2 - freedom) / corners), chi2 / freedom};
}

}  // namespace

fit_test test_fit(const bundle &data, const bundle_state &state, double sigma0) {
    std::vector<cell> image[CAMERAS], target(data.points.size());
    INVARIANT(!(sigma0 < 0) && state.T_left_board.size() == data.captures.size());
    double sigma2_px2 = 0;
    long count = 0;
    for (int camera = 0; camera < data.cameras; camera++) {
        image[camera].resize(size_t(CELLS_ACROSS * CELLS_DOWN));
        const lens_frame &frame = data.frame[camera];
        for (size_t i = 0; i < data.captures.size(); i++) {
            const bundle_view &view = data.captures[i][size_t(camera)];
            for (const bundle_corner &corner : view.corners) {
                double residual[2];
                if (!view.used || !corner.used ||
                    !corner_residual(data, camera, corner, state, state.T_left_board[i],
                                     residual)) {
                    continue;
                }
                const double scale = 1 / (sigma0 * corner.sigma_px);
                const int across = std::clamp(
                    int((corner.x_px + 0.5) / frame.width_px * CELLS_ACROSS), 0, CELLS_ACROSS - 1);
                const int down = std::clamp(int((corner.y_px + 0.5) / frame.height_px * CELLS_DOWN),
                                            0, CELLS_DOWN - 1);
                for (cell *one : {&image[camera][size_t(down * CELLS_ACROSS + across)],
                                  &target[size_t(corner.index)]}) {
                    one->x += scale * residual[0];
                    one->y += scale * residual[1];
                    one->count++;
                }
                sigma2_px2 += corner.sigma_px * corner.sigma_px;
                count++;
            }
        }
    }
    fit_test result;
    std::vector<cell> both = image[LEFT];
    both.insert(both.end(), image[RIGHT].begin(), image[RIGHT].end());
    const pattern in_image = find_pattern(both), on_board = find_pattern(target);
    result.image_z = in_image.z;
    result.board_z = on_board.z;
    const double noise_px = sigma0 * std::sqrt(sigma2_px2 / double(std::max(1L, count)));
    result.systematic_px = noise_px * std::sqrt(std::max(in_image.excess, on_board.excess));
    result.systematic_share = std::sqrt(std::max(in_image.excess, on_board.excess) / 2);
    result.alarm = (result.image_z > ALARM_Z || result.board_z > ALARM_Z) &&
                   result.systematic_px > MIN_PATTERN_PX;
    if (result.alarm) {
        result.widened = std::sqrt(std::max({1.0, in_image.ratio, on_board.ratio}));
    }
    return result;
}

}  // namespace calib

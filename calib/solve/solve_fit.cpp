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
const int RINGS = 12;           // number of rings from a lens's axis to the corners of the image
const size_t MIN_IN_RING = 4;   // boards
const double FURTHEST_PX = 20;  // further off, one corner counts as this

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

// The corners of one board in one ring about a lens's axis.
struct ring_sample {
    double outwards_px = 0;  // sum of residuals along the radius
    int corners = 0;

    double mean_px() const { return outwards_px / corners; }
};

// By ring, of all boards in it. Rejected corners of used views count, too: a lens outside the model
// loses those where it bends most.
std::vector<std::vector<ring_sample>> rings_of(const bundle &data, const bundle_state &state,
                                               int camera) {
    const lens_frame &frame = data.frame[camera];
    const lens_state &lens = state.lens[camera];
    std::vector<std::vector<ring_sample>> rings(RINGS);
    for (size_t i = 0; i < data.captures.size(); i++) {
        const bundle_view &view = data.captures[i][size_t(camera)];
        std::vector<ring_sample> board(RINGS);
        for (const bundle_corner &corner : view.corners) {
            double residual[2];
            if (!view.used ||
                !corner_residual(data, camera, corner, state, state.T_left_board[i], residual)) {
                continue;
            }
            const double x_px = corner.x_px - frame.middle_x_px - lens.value[CENTRE_X];
            const double y_px = corner.y_px - frame.middle_y_px - lens.value[CENTRE_Y];
            const double radius_px = std::max(1.0, std::hypot(x_px, y_px));
            const double ring = std::min(radius_px / frame.radius_px * RINGS, RINGS - 1.0);
            const double outwards_px = (residual[0] * x_px + residual[1] * y_px) / radius_px;
            board[size_t(ring)].outwards_px += std::clamp(outwards_px, -FURTHEST_PX, FURTHEST_PX);
            board[size_t(ring)].corners++;
        }
        for (size_t k = 0; k < rings.size(); k++) {
            if (board[k].corners > 0) {
                rings[k].push_back(board[k]);
            }
        }
    }
    return rings;
}

double median_px(std::vector<ring_sample> boards) {
    const auto middle = boards.begin() + long(boards.size() / 2);
    std::nth_element(
        boards.begin(), middle, boards.end(),
        [](const ring_sample &a, const ring_sample &b) { return a.mean_px() < b.mean_px(); });
    return middle->mean_px();
}

}  // namespace

lens_test test_lens(const bundle &data, const bundle_state &state, int camera) {
    INVARIANT(camera < data.cameras && state.T_left_board.size() == data.captures.size());
    double common_px2 = 0, own_px2 = 0;
    size_t rings = 0, boards = 0;
    int corners = 0;
    for (const std::vector<ring_sample> &ring : rings_of(data, state, camera)) {
        if (ring.size() < MIN_IN_RING) {
            continue;
        }
        const double common_px = median_px(ring);
        for (const ring_sample &board : ring) {
            const double own_px = board.mean_px() - common_px;
            common_px2 += board.corners * common_px * common_px;
            own_px2 += board.corners * own_px * own_px;
            corners += board.corners;
        }
        rings++;
        boards += ring.size();
    }
    if (rings < 2 || !(own_px2 > 0)) {
        return {};
    }
    return {std::sqrt(common_px2 / corners),
            common_px2 / double(rings) / (own_px2 / double(boards - rings))};
}

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

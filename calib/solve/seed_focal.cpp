// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "calib/solve/seed.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

const int GRID = 3;  // points per side that represent a homography
const double SCAN_FROM = 0.25, SCAN_TO = 80, SCAN_STEP = 1.2;
const double WIDE_FROM = 0.26, WIDE_TO = 0.95;  // 1 / the field of view in rad
const size_t WIDE_CORNERS = 20;                 // number of corners that represent a view
const double WIDE_LOSS = 3;

// Represents each homography by a view of few points: the cost of the scan does not grow with the
// number of corners, and outliers are already down-weighted.
bundle substitutes(const lens_frame &frame, const std::vector<homography> &seen) {
    bundle result;
    result.cameras = 1;
    result.frame[LEFT] = frame;
    for (const homography &one : seen) {
        bundle_view view;
        view.used = true;
        for (int i = 0; i < GRID * GRID; i++) {
            const double a = double(i % GRID) / (GRID - 1), b = double(i / GRID) / (GRID - 1);
            const double x = one.low_mm[0] + a * (one.high_mm[0] - one.low_mm[0]);
            const double y = one.low_mm[1] + b * (one.high_mm[1] - one.low_mm[1]);
            const double *H = one.H;
            const double z = H[6] * x + H[7] * y + H[8];
            view.corners.push_back({int(result.points.size()), (H[0] * x + H[1] * y + H[2]) / z,
                                    (H[3] * x + H[4] * y + H[5]) / z, 1, true});
            result.points.push_back({x, y, {}, {}});
        }
        result.captures.emplace_back();
        result.captures.back()[LEFT] = view;
    }
    return result;
}

// Sum over the views of their rms misfits: a view that is entirely wrong counts, but only once.
double misfit_at(const bundle &data, const std::vector<homography> &seen, double focal_px) {
    bundle_state state;
    state.lens[LEFT].value[LOG_FOCAL] = std::log(focal_px);
    INVARIANT(focal_px > 0 && data.captures.size() == seen.size());
    double sum = 0;
    for (size_t i = 0; i < seen.size(); i++) {
        rigid pose;
        double cost = -1;
        if (pose_from_homography(seen[i], focal_px, data.frame[LEFT].middle_x_px,
                                 data.frame[LEFT].middle_y_px, &pose)) {
            cost = fit_pose_either_way(data, data.captures[i], state, 0, &pose);
        }
        sum += cost >= 0 ? std::sqrt(cost) : seen[i].extent_px;
    }
    return sum;
}

// Where a misfit is lower than at its neighbours, lowest first.
std::vector<double> best_minima(const std::vector<double> &focal_px,
                                const std::vector<double> &misfit, size_t max) {
    std::vector<size_t> minima;
    for (size_t i = 0; i < misfit.size(); i++) {
        const bool falls_to = i == 0 || misfit[i] < misfit[i - 1];
        const bool rises_from = i + 1 == misfit.size() || misfit[i] <= misfit[i + 1];
        if (falls_to && rises_from) {
            minima.push_back(i);
        }
    }
    std::stable_sort(minima.begin(), minima.end(),
                     [&](size_t a, size_t b) { return misfit[a] < misfit[b]; });
    std::vector<double> result;
    for (size_t i = 0; i < minima.size() && i < max; i++) {
        result.push_back(focal_px[minima[i]]);
    }
    return result;
}

// Represents each used view by few of its corners.
bundle thinned(const bundle &alone) {
    bundle result = alone;
    for (auto &capture : result.captures) {
        bundle_view &view = capture[LEFT];
        const size_t stride = std::max<size_t>(1, view.corners.size() / WIDE_CORNERS);
        std::vector<bundle_corner> few;
        for (size_t i = 0; view.used && i < view.corners.size(); i += stride) {
            few.push_back(view.corners[i]);
            few.back().used = true;
        }
        view.corners = few;
    }
    return result;
}

// Sum over the views of their robust misfits, for an equidistant lens without coefficients.
double wide_misfit_at(const bundle &data, double focal_px) {
    static const double not_at_all = 1e4;
    bundle_state state;
    state.lens[LEFT].kind = LENS_EQUIDISTANT;
    state.lens[LEFT].value[LOG_FOCAL] = std::log(focal_px);
    double sum = 0;
    for (const auto &capture : data.captures) {
        homography seen;
        rigid pose;
        if (!capture[LEFT].used) {
            continue;
        }
        double cost = -1;
        if (fit_flat_homography(data, LEFT, capture[LEFT], state.lens[LEFT], &seen) &&
            pose_from_homography(seen, focal_px, data.frame[LEFT].middle_x_px,
                                 data.frame[LEFT].middle_y_px, &pose)) {
            cost = fit_pose_either_way(data, capture, state, WIDE_LOSS, &pose);
        }
        sum += cost >= 0 ? std::sqrt(cost) : not_at_all;
    }
    return sum;
}

// Median distance of the corners from where the pose predicts them; a single-camera bundle.
double median_off_px(const bundle &alone, const bundle_state &state, const bundle_view &view,
                     const rigid &T_camera_board) {
    std::vector<double> off;
    const size_t stride = std::max<size_t>(1, view.corners.size() / 12);
    for (size_t i = 0; i < view.corners.size(); i += stride) {
        double residual[2];
        const bool seen =
            corner_residual(alone, LEFT, view.corners[i], state, T_camera_board, residual);
        off.push_back(seen ? std::hypot(residual[0], residual[1]) : 1e9);
    }
    INVARIANT(!off.empty());
    std::nth_element(off.begin(), off.begin() + long(off.size() / 2), off.end());
    return off[off.size() / 2];
}

}  // namespace

std::vector<double> scan_focal_lengths(const lens_frame &frame, const std::vector<homography> &seen,
                                       size_t max) {
    const bundle data = substitutes(frame, seen);
    const double side = std::max(frame.width_px, frame.height_px);
    std::vector<double> focal_px, misfit;
    for (double factor = SCAN_FROM; factor <= SCAN_TO * SCAN_STEP; factor *= SCAN_STEP) {
        focal_px.push_back(factor * side);
        misfit.push_back(misfit_at(data, seen, focal_px.back()));
    }
    return best_minima(focal_px, misfit, max);
}

std::vector<double> scan_equidistant(const bundle &alone, size_t max) {
    const bundle data = thinned(alone);
    const double side = std::max(data.frame[LEFT].width_px, data.frame[LEFT].height_px);
    std::vector<double> focal_px, misfit;
    for (double factor = WIDE_FROM; factor <= WIDE_TO; factor *= SCAN_STEP) {
        focal_px.push_back(factor * side);
        misfit.push_back(wide_misfit_at(data, focal_px.back()));
    }
    return best_minima(focal_px, misfit, max);
}

std::vector<double> vote_rig(const bundle &data, const lens_state &right,
                             const std::vector<rigid> (&T_camera_board)[CAMERAS],
                             const std::vector<size_t> &pairs, rigid *T_right_left) {
    bundle alone;
    alone.cameras = 1;
    alone.frame[LEFT] = data.frame[RIGHT];
    alone.points = data.points;
    bundle_state state;
    state.lens[LEFT] = right;
    std::vector<double> best(pairs.size(), 1e9);
    INVARIANT(!pairs.empty());
    INVARIANT(T_camera_board[LEFT].size() == T_camera_board[RIGHT].size());
    double best_middle = INFINITY;
    for (const size_t candidate : pairs) {
        const rigid T = T_camera_board[RIGHT][candidate] * inverse(T_camera_board[LEFT][candidate]);
        std::vector<double> off;
        for (const size_t pair : pairs) {
            off.push_back(median_off_px(alone, state, data.captures[pair][RIGHT],
                                        T * T_camera_board[LEFT][pair]));
        }
        std::vector<double> sorted = off;
        std::nth_element(sorted.begin(), sorted.begin() + long(sorted.size() / 2), sorted.end());
        if (sorted[sorted.size() / 2] < best_middle) {
            best_middle = sorted[sorted.size() / 2];
            best = off;
            *T_right_left = T;
        }
    }
    return best;
}

}  // namespace calib

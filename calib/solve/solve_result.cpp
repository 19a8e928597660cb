// SPDX-License-Identifier: Apache-2.0
#include "calib/solve/solve_result.hpp"

#include <algorithm>
#include <cmath>

#include "calib/solve/robust_reason.hpp"
#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

// From the solver's board frame (middle, zero-mean warp) to that of board.hpp (first corner).
rigid to_first_corner(const bundle &data, const bundle_state &state, const rigid &T_left_middle) {
    rigid T_middle_corner;
    T_middle_corner.t_mm[0] = -data.half_mm[0];
    T_middle_corner.t_mm[1] = -data.half_mm[1];
    T_middle_corner.t_mm[2] =
        -(state.warp_mm[board_model::BEND_X] + state.warp_mm[board_model::BEND_Y]) / 3;
    return T_left_middle * T_middle_corner;
}

void describe_lenses(const bundle &data, const bundle_state &state, solution *result) {
    for (int camera = 0; camera < data.cameras; camera++) {
        result->camera[camera] = lens_from_state(data.frame[camera], state.lens[camera]);
    }
    std::copy_n(state.warp_mm, int(WARP_PARAMETERS), result->warp_mm);
    if (data.cameras == CAMERAS) {
        result->T_right_left = state.T_right_left;
        result->rig.left = result->camera[LEFT];
        result->rig.right = result->camera[RIGHT];
        double turn_rad[3];
        const int code = geometry_vector_from_rotation(state.T_right_left.R, turn_rad);
        INVARIANT(code == ERROR_OK);  // `adjust` keeps it orthonormal
        std::copy_n(turn_rad, 3, result->rig.rotation_right_left_rad);
        std::copy_n(state.T_right_left.t_mm, 3, result->rig.translation_right_left_mm);
    }
}

// One camera's view of one position; sums the squares of the used corners.
void describe_view(const bundle &data, const bundle_state &state, size_t ordered, size_t caller,
                   int camera, solution *result) {
    const bundle_view &view = data.captures[ordered][size_t(camera)];
    view_summary &summary = result->views[caller][size_t(camera)];
    INVARIANT(caller < result->views.size() && ordered < data.captures.size());
    summary.used = view.used;
    double squares = 0;
    for (const bundle_corner &corner : view.corners) {
        corner_residual_px entry{caller,      camera,          corner.index,
                                 corner.x_px, corner.y_px,     0,
                                 0,           corner.sigma_px, view.used && corner.used};
        double residual[2];
        if (result->board_known[caller] &&
            corner_residual(data, camera, corner, state, state.T_left_board[ordered], residual)) {
            entry.dx_px = residual[0];
            entry.dy_px = residual[1];
        }
        result->residuals.push_back(entry);
        if (entry.used) {
            squares += entry.dx_px * entry.dx_px + entry.dy_px * entry.dy_px;
            summary.corners_used++;
        } else if (view.used) {
            const double off_px = std::hypot(entry.dx_px, entry.dy_px);
            result->rejected_corners.push_back(
                {caller, camera, corner.index, off_px,
                 corner_reason(data, camera, corner, state, state.T_left_board[ordered], off_px)});
        }
    }
    summary.rms_px = std::sqrt(squares / std::max(1, summary.corners_used));
}

// Per point, over all used corners, summed in the solver's order so that the caller's order does
// not matter.
double rms_of(const bundle &data, const bundle_state &state) {
    double squares = 0;
    long count = 0;
    for_used_residuals(data, state, [&](const bundle_corner &, const double *residual_px) {
        squares += residual_px[0] * residual_px[0] + residual_px[1] * residual_px[1];
        count++;
    });
    return std::sqrt(squares / double(std::max(1L, count)));
}

// Of the boards that both cameras see.
double board_distance_mm(const bundle &data, const bundle_state &state) {
    std::vector<double> distances;
    for (size_t i = 0; i < data.captures.size(); i++) {
        if (data.captures[i][LEFT].used && data.captures[i][RIGHT].used) {
            distances.push_back(state.T_left_board[i].t_mm[2]);
        }
    }
    const auto middle = distances.begin() + long(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return distances.empty() ? 0 : *middle;
}

// Across, about the middle of what both cameras see at the distance of the boards: small, so that
// they do see it.
length_test length_of(const bundle &data, const bundle_state &state, const error_model &errors) {
    const double share = 0.01;
    length_test result;
    const double *t_mm = state.T_right_left.t_mm, *R = state.T_right_left.R;
    result.distance_mm = board_distance_mm(data, state);
    // Half way between where the two axes are at this distance.
    const double right_x_mm = -(R[0] * t_mm[0] + R[3] * t_mm[1] + R[6] * t_mm[2]);
    const double right_slope = R[8] > 0 ? R[6] / R[8] : 0;
    const double middle_mm = 0.5 * (right_x_mm + right_slope * result.distance_mm);
    const double half_mm = 0.5 * share * result.distance_mm;
    const double first[3] = {middle_mm - half_mm, 0, result.distance_mm};
    const double second[3] = {middle_mm + half_mm, 0, result.distance_mm};
    double sigma_mm = 0;
    if (result.distance_mm > 0 && errors.length_sigma(first, second, &sigma_mm)) {
        result.sigma_mm = sigma_mm / (2 * half_mm) * result.length_mm;
    }
    return result;
}

}  // namespace

solution describe(const observations &seen, const ordered_bundle &ordered,
                  const view_records &records, const bundle_state &state) {
    const bundle &data = ordered.data;
    solution result;
    const size_t count = seen.captures.size();
    INVARIANT(ordered.caller.size() == count && data.captures.size() == count);
    INVARIANT(records.size() == count);
    result.T_left_board.resize(count);
    result.board_known.assign(count, false);
    result.views.resize(count);
    std::vector<size_t> place(count);  // index in the bundle, by the caller's position
    for (size_t i = 0; i < count; i++) {
        place[ordered.caller[i]] = i;
    }
    const bool solved = state.T_left_board.size() == count;
    if (solved) {
        describe_lenses(data, state, &result);
    }
    for (size_t caller = 0; caller < count; caller++) {
        const size_t i = place[caller];
        result.board_known[caller] = solved && data.used(i);
        if (result.board_known[caller]) {
            result.T_left_board[caller] = to_first_corner(data, state, state.T_left_board[i]);
            result.captures_used++;
            result.pairs_used += data.captures[i][LEFT].used && data.captures[i][RIGHT].used;
        }
        for (int camera = 0; camera < data.cameras; camera++) {
            describe_view(data, state, i, caller, camera, &result);
            const view_record &record = records[i][size_t(camera)];
            if (!record.reason.empty()) {
                result.rejected_views.push_back({caller, camera, record.turned, record.reason});
            }
        }
    }
    result.rms_px = solved ? rms_of(data, state) : 0;
    result.rig.rms_px = result.rms_px;
    return result;
}

void describe_errors(const bundle &data, const bundle_state &state, const error_model &errors,
                     solution *result) {
    result->sigma0 = errors.sigma0();
    INVARIANT(!(result->sigma0 < 0));
    solution_sigmas &sigma = result->sigma;
    for (int camera = 0; camera < data.cameras; camera++) {
        const size_t place = size_t(camera);
        const double focal_px = std::exp(state.lens[camera].value[LOG_FOCAL]);
        sigma.focal_px[place] = focal_px * errors.lens_sigma(camera, LOG_FOCAL);
        sigma.centre_x_px[place] = errors.lens_sigma(camera, CENTRE_X);
        sigma.centre_y_px[place] = errors.lens_sigma(camera, CENTRE_Y);
    }
    if (data.cameras == CAMERAS) {
        sigma.baseline_mm = errors.baseline_sigma_mm();
        for (int i = 0; i < 3; i++) {
            sigma.rotation_rad[size_t(i)] = errors.rig_sigma(i);
            sigma.translation_mm[size_t(i)] = errors.rig_sigma(3 + i);
        }
        result->length = length_of(data, state, errors);
    }
    result->errors = std::make_shared<const error_model>(errors);
}

}  // namespace calib

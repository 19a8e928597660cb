// SPDX-License-Identifier: Apache-2.0
#include "calib/zoom/zoom_view.hpp"

#include <cmath>

#include "core/invariant.h"
#include "stereo/geometry/geometry.h"

namespace calib {

namespace {

// What short focal lengths add to the standard deviation of a focus that was found, px^2 / m: of
// the recorded capture at f/8, 0.02 1/m at 5,700 px. A blur is f^2 / N times the difference in
// dioptres.
const double FOCUSED_WIDE = 6.5e5;

const zoom_latents LATENT_STEP = {1e-3, 0.1, 0.1, 1e-5};

void difference(const posed_camera &above, const posed_camera &below, double step, double *column) {
    for (int i = 0; i < VIEW_POSE_AT; i++) {
        column[i] = (above.lens.value[size_t(i)] - below.lens.value[size_t(i)]) / (2 * step);
    }
    const double *a = above.T_camera_instrument.R, *b = below.T_camera_instrument.R;
    double turn[9];  // above below^T
    for (int row = 0; row < 3; row++) {
        for (int k = 0; k < 3; k++) {
            turn[3 * row + k] = geometry_dot(a + 3 * row, b + 3 * k);
        }
    }
    column[VIEW_POSE_AT] = (turn[7] - turn[5]) / (4 * step);
    column[VIEW_POSE_AT + 1] = (turn[2] - turn[6]) / (4 * step);
    column[VIEW_POSE_AT + 2] = (turn[3] - turn[1]) / (4 * step);
    for (int i = 0; i < 3; i++) {
        column[VIEW_POSE_AT + 3 + i] =
            (above.T_camera_instrument.t_mm[i] - below.T_camera_instrument.t_mm[i]) / (2 * step);
    }
}

matrix derivatives(const zoom_problem &problem, const zoom_layout &layout,
                   const zoom_estimate &estimate, size_t capture, int camera,
                   const std::vector<int> &columns) {
    const zoom_view_state view_state = view_state_of(problem.captures[capture], camera);
    const zoom_latents &latent = estimate.latent[capture][size_t(camera)];
    std::vector<double> shared = estimate.shared;
    matrix result(VIEW_BOARD_AT, long(columns.size()) + LATENTS);
    for (size_t i = 0; i < columns.size(); i++) {
        double &value = shared[size_t(columns[i])];
        const double middle = value;
        const double step = layout.step(columns[i]);
        value = middle + step;
        const posed_camera above = camera_at(problem, layout, shared.data(), view_state, latent);
        value = middle - step;
        const posed_camera below = camera_at(problem, layout, shared.data(), view_state, latent);
        value = middle;
        difference(above, below, step, result.col(long(i)).data());
    }
    for (size_t i = 0; i < LATENTS; i++) {
        zoom_latents above = latent, below = latent;
        above[i] += LATENT_STEP[i];
        below[i] -= LATENT_STEP[i];
        difference(camera_at(problem, layout, shared.data(), view_state, above),
                   camera_at(problem, layout, shared.data(), view_state, below), LATENT_STEP[i],
                   result.col(long(columns.size() + i)).data());
    }
    return result;
}

void add_corner(const corner_rows &rows, double weight, view_block *sum) {
    Eigen::Matrix<double, 2, VIEW_PARAMETERS> J;
    for (int axis = 0; axis < 2; axis++) {
        double *out = &J(axis, 0);
        const auto put = [&out](const double *values, int count) {
            for (int i = 0; i < count; i++, out += 2) {
                *out = values[i];
            }
        };
        put(rows.by_lens[axis], VIEW_POSE_AT);
        put(rows.by_rig[axis], POSE_PARAMETERS);
        put(rows.by_board[axis], POSE_PARAMETERS);
        put(rows.by_warp[axis], WARP_PARAMETERS);
    }
    const Eigen::Vector2d r(rows.residual_px[0], rows.residual_px[1]);
    sum->normal.noalias() += weight * (J.transpose() * J);
    sum->gradient.noalias() += weight * (J.transpose() * r);
}

}  // namespace

posed_camera fitted_camera(const zoom_problem &problem, const zoom_layout &layout,
                           const zoom_estimate &estimate, size_t capture, int camera) {
    return camera_at(problem, layout, estimate.shared.data(),
                     view_state_of(problem.captures[capture], camera),
                     estimate.latent[capture][size_t(camera)]);
}

bool zoom_residual(const zoom_problem &problem, const zoom_layout &layout,
                   const zoom_estimate &estimate, const posed_camera &posed, size_t capture,
                   int camera, const bundle_corner &corner, double residual_px[2]) {
    const zoom_problem::capture &shot = problem.captures[capture];
    const bundle &board = problem.boards[shot.board][size_t(camera)];
    double on_board[3], in_instrument[3], in_camera[3], pixel[2];
    warped(board.points[size_t(corner.index)], estimate.shared.data() + layout.warp_at(shot.board),
           on_board);
    apply(estimate.T_instrument_board[shot.place], on_board, in_instrument);
    apply(posed.T_camera_instrument, in_instrument, in_camera);
    if (!project(board.frame[RIGHT], posed.lens, in_camera, pixel)) {
        return false;
    }
    residual_px[0] = pixel[0] - corner.x_px;
    residual_px[1] = pixel[1] - corner.y_px;
    return true;
}

view_block view_block_of(const zoom_problem &problem, const zoom_layout &layout, double loss_scale,
                         const zoom_estimate &estimate, size_t capture, int camera) {
    const zoom_problem::capture &shot = problem.captures[capture];
    const bundle &board = problem.boards[shot.board][size_t(camera)];
    view_block block;
    block.posed = fitted_camera(problem, layout, estimate, capture, camera);
    block.columns = layout.columns(camera, shot.setting[size_t(camera)], shot.visit);
    block.by_column = derivatives(problem, layout, estimate, capture, camera, block.columns);
    block.normal = matrix::Zero(VIEW_PARAMETERS, VIEW_PARAMETERS);
    block.gradient = vector::Zero(VIEW_PARAMETERS);
    const double *warp = estimate.shared.data() + layout.warp_at(shot.board);
    for (const bundle_corner &corner : shot.view[size_t(camera)].corners) {
        corner_rows rows;
        if (!corner.used || !make_corner_rows(board, RIGHT, corner, block.posed.lens,
                                              estimate.T_instrument_board[shot.place],
                                              block.posed.T_camera_instrument, warp, &rows)) {
            continue;
        }
        const double inverse = 1 / (corner.sigma_px * corner.sigma_px);
        const double *r = rows.residual_px;
        const double square = inverse * (r[0] * r[0] + r[1] * r[1]);
        const double scale2 = loss_scale * loss_scale;
        add_corner(rows, inverse / (scale2 > 0 ? 1 + square / scale2 : 1), &block);
        block.squares += scale2 > 0 ? scale2 * std::log1p(square / scale2) : square;
        block.residuals += 2;
    }
    return block;
}

namespace {

// A lens at an end of its range may not have reached the board.
bool is_at_stop(const zoom_range &range, double counts) {
    const double near = 0.02 * (range.max - range.min);
    return counts < range.min + near || counts > range.max - near;
}

/// The used corner next to the middle of the picture; null: none is used.
const bundle_corner *corner_in_middle(const lens_frame &frame, const bundle_view &view) {
    const bundle_corner *found = nullptr;
    double nearest_px = INFINITY;
    for (const bundle_corner &corner : view.corners) {
        const double off_px =
            std::hypot(corner.x_px - frame.middle_x_px, corner.y_px - frame.middle_y_px);
        if (corner.used && off_px < nearest_px) {
            nearest_px = off_px;
            found = &corner;
        }
    }
    return found;
}

}  // namespace

focus_row focus_row_of(const zoom_problem &problem, const zoom_layout &layout, size_t capture,
                       int camera, const posed_camera &posed, const rigid &T_instrument_board) {
    const zoom_side &side = problem.side[size_t(camera)];
    const zoom_problem::capture &shot = problem.captures[capture];
    const zoom_axes &axes = shot.axes[size_t(camera)];
    focus_row row;
    if (shot.focused_sigma <= 0 || is_at_stop(side.focus, axes.focus_counts)) {
        return row;
    }
    const bundle_corner *middle = corner_in_middle(side.frame, shot.view[size_t(camera)]);
    if (middle == nullptr) {
        return row;
    }
    const bundle &board = problem.boards[shot.board][size_t(camera)];
    double in_instrument[3], in_camera[3];
    const board_point &point = board.points[size_t(middle->index)];
    const double on_board[3] = {point.x_mm, point.y_mm, 0};
    apply(T_instrument_board, on_board, in_instrument);
    apply(posed.T_camera_instrument, in_instrument, in_camera);
    row.residual = posed.focus_dioptre - 1e3 / std::fmax(1, in_camera[2]);
    INVARIANT(posed.focal_px > 0);
    row.sigma = std::hypot(shot.focused_sigma, FOCUSED_WIDE / (posed.focal_px * posed.focal_px));
    double basis[ZOOM_TERMS_MAX];
    zoom_chebyshev(zoom_range_unit(&side.log_focal, std::log(posed.focal_px)), ZOOM_TERMS_MAX,
                   basis);
    for (int i = 0; i < layout.estimated_terms(ZOOM_FOCUS_DIOPTRE); i++) {
        row.columns.push_back(layout.terms_at(camera, ZOOM_FOCUS_DIOPTRE) + i);
        row.derivatives.push_back(basis[i]);
    }
    zoom_chebyshev(zoom_range_unit(&side.focus, axes.focus_counts), ZOOM_FOCUS_TERMS + 1, basis);
    for (int i = 0; i < ZOOM_FOCUS_TERMS; i++) {
        row.columns.push_back(layout.focus_at(camera) + i);
        row.derivatives.push_back(basis[i + 1]);
    }
    return row;
}

double squares_of(const zoom_problem &problem, const zoom_layout &layout, const zoom_prior &prior,
                  double loss_scale, const zoom_estimate &estimate, size_t place) {
    double sum = 0;
    const double scale2 = loss_scale * loss_scale;
    for (const size_t index : problem.places[place].captures) {
        for (int camera = 0; camera < CAMERAS; camera++) {
            if (!problem.captures[index].view[size_t(camera)].used) {
                continue;
            }
            for (size_t i = 0; i < LATENTS; i++) {
                const double sigma = prior.latent_sigma[size_t(camera)][i];
                const double off = estimate.latent[index][size_t(camera)][i];
                sum += sigma > 0 ? off * off / (sigma * sigma) : 0;
            }
            const posed_camera posed = fitted_camera(problem, layout, estimate, index, camera);
            const focus_row row = focus_row_of(problem, layout, index, camera, posed,
                                               estimate.T_instrument_board[place]);
            const double focus = row.columns.empty() ? 0 : row.residual / row.sigma;
            sum += focus * focus;
            for (const bundle_corner &corner :
                 problem.captures[index].view[size_t(camera)].corners) {
                double r[2];
                if (!corner.used) {
                    continue;
                }
                if (!zoom_residual(problem, layout, estimate, posed, index, camera, corner, r)) {
                    return INFINITY;
                }
                const double square =
                    (r[0] * r[0] + r[1] * r[1]) / (corner.sigma_px * corner.sigma_px);
                sum += scale2 > 0 ? scale2 * std::log1p(square / scale2) : square;
            }
        }
    }
    return sum;
}

}  // namespace calib

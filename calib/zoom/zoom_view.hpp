// SPDX-License-Identifier: Apache-2.0
/// The corners of one view as equations.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_VIEW_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_VIEW_HPP

#include <vector>

#include "calib/base/linear.hpp"
#include "calib/zoom/zoom_model.hpp"

namespace calib {

posed_camera fitted_camera(const zoom_problem &problem, const zoom_layout &layout,
                           const zoom_estimate &estimate, size_t capture, int camera);

/// Residual of one corner (predicted minus seen, px); false behind the camera.
bool zoom_residual(const zoom_problem &problem, const zoom_layout &layout,
                   const zoom_estimate &estimate, const posed_camera &posed, size_t capture,
                   int camera, const bundle_corner &corner, double residual_px[2]);

/// What a view's corners depend on: lens and pose of the camera, pose of the board, warp.
enum {
    VIEW_POSE_AT = K4,  // lenses of zooms are Brown-Conrady
    VIEW_BOARD_AT = VIEW_POSE_AT + POSE_PARAMETERS,
    VIEW_WARP_AT = VIEW_BOARD_AT + POSE_PARAMETERS,
    VIEW_PARAMETERS = VIEW_WARP_AT + WARP_PARAMETERS,
};

/// A view's corners as a quadratic form in the changes of those.
struct view_block {
    posed_camera posed;
    std::vector<int> columns;  // shared parameters that the camera depends on
    /// Lens and pose of the camera by each of them, and by the latents (last columns).
    matrix by_column;
    matrix normal;  // VIEW_PARAMETERS each way
    vector gradient;
    double squares = 0;
    long residuals = 0;
};

view_block view_block_of(const zoom_problem &problem, const zoom_layout &layout, double loss_scale,
                         const zoom_estimate &estimate, size_t capture, int camera);

/// The lens was focused on the board: the dioptre of the sharp plane minus that of the corner next
/// to the middle of the picture. Without columns where that is unknown, and at an end of the focus,
/// which may not reach the board.
struct focus_row {
    double residual = 0, sigma = 0;  // 1/m
    std::vector<int> columns;
    std::vector<double> derivatives;
};
focus_row focus_row_of(const zoom_problem &problem, const zoom_layout &layout, size_t capture,
                       int camera, const posed_camera &posed, const rigid &T_instrument_board);

/// Squares of one place's residuals, in standard deviations, and of its latents.
double squares_of(const zoom_problem &problem, const zoom_layout &layout, const zoom_prior &prior,
                  double loss_scale, const zoom_estimate &estimate, size_t place);

}  // namespace calib

#endif

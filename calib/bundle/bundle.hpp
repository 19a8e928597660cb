// SPDX-License-Identifier: Apache-2.0
/// Bundle adjustment: the lenses, the pose of the right camera, the warp of the board and all board
/// positions that explain the corners best. Everything is in the left camera's frame; in this file
/// the board's frame has its origin in the middle of the board.
#ifndef VERGENCE_CALIB_BUNDLE_BUNDLE_HPP
#define VERGENCE_CALIB_BUNDLE_BUNDLE_HPP

#include <array>
#include <vector>

#include "calib/base/board.hpp"
#include "calib/base/lens_scale.hpp"
#include "calib/base/rigid.hpp"

namespace calib {

enum { LEFT, RIGHT, CAMERAS };
enum { POSE_PARAMETERS = 6, WARP_PARAMETERS = board_model::PARAMETERS };

/// A corner of the board as drawn, and its displacement per mm of each warp.
struct board_point {
    double x_mm, y_mm;
    double lift[3];     // displacement out of the plane by BEND_X, BEND_Y and TWIST
    double stretch[2];  // displacement in the plane by STRETCH: x, y
};

/// One corner in one image, as the solver uses it.
struct bundle_corner {
    int index;  // number of the corner on the board
    double x_px, y_px;
    double sigma_px;
    bool used;
};

struct bundle_view {
    std::vector<bundle_corner> corners;
    bool used = false;         // false: the view is ignored
    bool overexposed = false;  // overexposure may have shifted its corners

    bool empty() const { return corners.empty(); }
    int used_count() const;
};

/// The measurements. With one camera everything of RIGHT is empty.
struct bundle {
    int cameras = CAMERAS;
    lens_frame frame[CAMERAS];
    std::vector<board_point> points;  // points of the board, indexed by corner
    double half_mm[2] = {1, 1};       // half of the board's width and height
    std::vector<std::array<bundle_view, CAMERAS>> captures;

    /// True when the view of any camera is used.
    bool used(size_t capture) const;
};

/// The estimated state.
struct bundle_state {
    lens_state lens[CAMERAS];
    rigid T_right_left;
    double warp_mm[WARP_PARAMETERS] = {0, 0, 0, 0};
    std::vector<rigid> T_left_board;  // poses by board position
};

/// The points of a board, relative to its middle.
std::vector<board_point> make_board_points(const board &board, double half_mm[2]);

/// One camera's part of a bundle as a single-camera bundle, and of a state. Poses are in that
/// camera's frame.
bundle single_camera(const bundle &data, int camera);

/// Share by which the print's rows are longer than drawn relative to its columns, unsigned.
double print_stretch(const bundle &data, const bundle_state &state);

/// Position of a board point in the board's frame, warp included.
void warped(const board_point &point, const double warp_mm[WARP_PARAMETERS], double point_mm[3]);

/// Residual (predicted minus seen, px) of one corner and its derivatives by the estimated
/// parameters. Pose increments are (rotation in rad of the left frame, then shift of t.x / t.z, t.y
/// / t.z and log t.z); those of T_right_left are (rotation in the right frame, shift in mm).
struct corner_rows {
    double residual_px[2];
    double by_lens[2][LENS_PARAMETERS];
    double by_board[2][POSE_PARAMETERS];
    double by_rig[2][POSE_PARAMETERS];  // 0 for the left camera
    double by_warp[2][WARP_PARAMETERS];
};

/// Returns false when the point is not in front of the camera.
bool make_corner_rows(const bundle &data, int camera, const bundle_corner &corner,
                      const lens_state &lens, const rigid &T_left_board, const rigid &T_right_left,
                      const double warp_mm[WARP_PARAMETERS], corner_rows *rows);

/// The residual alone.
bool corner_residual(const bundle &data, int camera, const bundle_corner &corner,
                     const bundle_state &state, const rigid &T_left_board, double residual_px[2]);

/// Calls `call(corner, residual_px)` for each used corner in front of its camera, position by
/// position.
template <class Call>
void for_used_residuals(const bundle &data, const bundle_state &state, const Call &call) {
    for (size_t i = 0; i < data.captures.size(); i++) {
        for (int camera = 0; camera < data.cameras; camera++) {
            const bundle_view &view = data.captures[i][size_t(camera)];
            for (const bundle_corner &corner : view.corners) {
                double residual_px[2];
                if (view.used && corner.used &&
                    corner_residual(data, camera, corner, state, state.T_left_board[i],
                                    residual_px)) {
                    call(corner, residual_px);
                }
            }
        }
    }
}

/// The pose after the increment described at `corner_rows`.
rigid moved_board(const rigid &T_left_board, const double increment[POSE_PARAMETERS]);
rigid moved_rig(const rigid &T_right_left, const double increment[POSE_PARAMETERS]);

/// Which parameters are estimated, and how.
struct bundle_options {
    std::array<bool, LENS_PARAMETERS> free_lens{};
    std::array<bool, WARP_PARAMETERS> free_warp{};
    /// Scale in standard deviations of the Cauchy loss on a corner's distance; 0 for least squares.
    double loss_scale = 0;
    int max_iterations = 60;
    /// Relative change of the cost below which the iteration ends. A cost is several thousand, and
    /// a change of one in it is one standard deviation of some parameter.
    double tolerance = 1e-13;
};

/// All parameters that the models estimate.
bundle_options options_of(lens_model lens, board_model board, double loss_scale);

/// Tolerance of an intermediate solution.
const double ROUGH_TOLERANCE = 1e-7;

struct bundle_summary {
    bool converged = false;
    double cost = 0;  // half of the sum of squares (after the loss), in standard deviations
    int iterations = 0;
};

/// Minimises over all used corners of used views, starting from `state` and storing the result
/// there. Corners are weighted by 1 / sigma_px. The same input gives the same bytes: one thread,
/// one order.
bundle_summary adjust(const bundle &data, const bundle_options &options, bundle_state *state);

/// True when a view has at least `min` used corners and they span an area of the board, so that
/// they determine a pose.
bool spans_area(const bundle &data, const bundle_view &view, int min);

}  // namespace calib

#endif

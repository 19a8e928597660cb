// SPDX-License-Identifier: Apache-2.0
/// Bundle adjustment: the lenses, the pose of the right camera, the warp of the board and all
/// positions of the board that explain the corners best. Everything is told in the left camera's
/// frame; the board's frame of this file has its origin in the middle of the board.
#ifndef VERGENCE_CALIB_BUNDLE_BUNDLE_HPP
#define VERGENCE_CALIB_BUNDLE_BUNDLE_HPP

#include <array>
#include <vector>

#include "calib/base/board.hpp"
#include "calib/base/lens_scale.hpp"
#include "calib/base/rigid.hpp"

namespace calib {

enum { LEFT, RIGHT, CAMERAS };
enum { POSE_PLACES = 6, WARP_PLACES = board_model::PLACES };

/// A corner of the board where it was drawn, and by how much one mm of each warp moves it.
struct board_point {
    double x_mm, y_mm;
    double lift[3];     // out of the plane, by BEND_X, BEND_Y and TWIST
    double stretch[2];  // within it
};

/// One corner in one image as the solver uses it.
struct bundle_corner {
    int index;  // on the board
    double x_px, y_px;
    double sigma_px;
    bool used;
};

struct bundle_view {
    std::vector<bundle_corner> corners;
    bool used = false;         // false: nothing of it counts
    bool overexposed = false;  // its corners may be off for that

    bool empty() const { return corners.empty(); }
    int used_count() const;
};

/// What was measured. With one camera everything of RIGHT is empty.
struct bundle {
    int cameras = CAMERAS;
    lens_frame frame[CAMERAS];
    std::vector<board_point> points;  // by index
    double half_mm[2] = {1, 1};       // half of the board's width and height
    std::vector<std::array<bundle_view, CAMERAS>> sightings;

    /// True when any camera's view of it counts.
    bool used(size_t sighting) const;
};

/// What is estimated.
struct bundle_state {
    lens_state lens[CAMERAS];
    rigid T_right_left;
    double warp_mm[WARP_PLACES] = {0, 0, 0, 0};
    std::vector<rigid> T_left_board;  // by sighting
};

/// The points of a board, from its middle.
std::vector<board_point> make_board_points(const board &board, double half_mm[2]);

/// The camera's own part of a bundle as a bundle of one camera, and of a state. Poses are told in
/// that camera's frame.
bundle single_camera(const bundle &data, int camera);

/// By which share the print's rows are longer than drawn against its columns, without sign.
double print_stretch(const bundle &data, const bundle_state &state);

/// Position of a board point in the board's frame, warp included.
void warped(const board_point &point, const double warp_mm[WARP_PLACES], double point_mm[3]);

/// Residual (predicted minus seen, px) of one corner and its derivatives by what is estimated:
/// pose increments are (turn in rad of the left frame, then shift of t.x / t.z, t.y / t.z and
/// log t.z); those of T_right_left are (turn in the right frame, shift in mm).
struct corner_rows {
    double residual_px[2];
    double by_lens[2][LENS_PLACES];
    double by_board[2][POSE_PLACES];
    double by_rig[2][POSE_PLACES];  // 0 for the left camera
    double by_warp[2][WARP_PLACES];
};

/// Returns false when the point is not in front of the camera.
bool make_corner_rows(const bundle &data, int camera, const bundle_corner &corner,
                      const lens_state &lens, const rigid &T_left_board, const rigid &T_right_left,
                      const double warp_mm[WARP_PLACES], corner_rows *rows);

/// The residual alone.
bool corner_residual(const bundle &data, int camera, const bundle_corner &corner,
                     const bundle_state &state, const rigid &T_left_board, double residual_px[2]);

/// Calls `call(corner, residual_px)` for each corner in use that lies in front of its camera,
/// sighting by sighting.
template <class Call>
void for_used_residuals(const bundle &data, const bundle_state &state, const Call &call) {
    for (size_t i = 0; i < data.sightings.size(); i++) {
        for (int camera = 0; camera < data.cameras; camera++) {
            const bundle_view &view = data.sightings[i][size_t(camera)];
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
rigid moved_board(const rigid &T_left_board, const double increment[POSE_PLACES]);
rigid moved_rig(const rigid &T_right_left, const double increment[POSE_PLACES]);

/// What is estimated and how.
struct bundle_options {
    std::array<bool, LENS_PLACES> free_lens{};
    std::array<bool, WARP_PLACES> free_warp{};
    /// Scale in standard deviations of the Cauchy loss on a corner's distance; 0 for least squares.
    double loss_scale = 0;
    int max_iterations = 60;
    /// Relative change of the cost below which it is over. A cost is some thousand, and a change of
    /// one in it is one standard deviation of something.
    double tolerance = 1e-13;
};

/// All numbers that the models estimate.
bundle_options options_of(lens_model lens, board_model board, double loss_scale);

/// Tolerance of what is only a step on the way.
const double ROUGH_TOLERANCE = 1e-7;

struct bundle_summary {
    bool converged = false;
    double cost = 0;  // half of the sum of squares (after the loss), in standard deviations
    int iterations = 0;
};

/// Minimises over all used corners of used views, from `state` and into it. Corners are weighted
/// by 1 / sigma_px. The same input gives the same bytes: one thread, one order.
bundle_summary adjust(const bundle &data, const bundle_options &options, bundle_state *state);

/// True when the used corners of a view number at least `least` and span an area of the board, so
/// that they determine a pose.
bool spans_area(const bundle &data, const bundle_view &view, int least);

}  // namespace calib

#endif

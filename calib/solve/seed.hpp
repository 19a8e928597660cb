// SPDX-License-Identifier: Apache-2.0
/// Initial values for the solver: homographies of the views, focal lengths from them, poses, and
/// the pose of the right camera by a vote of the pairs. Distortion is left to the adjustment.
#ifndef VERGENCE_CALIB_SOLVE_SEED_HPP
#define VERGENCE_CALIB_SOLVE_SEED_HPP

#include <vector>

#include "calib/bundle/bundle.hpp"
#include "calib/solve/seed_pose.hpp"

namespace calib {

/// Pixel (up to a factor) = H (x_mm, y_mm, 1) of the flat board. Row-major.
struct homography {
    double H[9];
    double misfit_px = 0;          // median distance of the corners
    double extent_px = 0;          // rms distance of the corners from their middle
    bool mirrored = false;         // the corners are numbered as if the board was seen from behind
    double low_mm[2], high_mm[2];  // the part of the board that was seen
};

/// By the normalised direct linear transformation, repeated with weights that suppress outlying
/// corners. Uses all corners of the view, used or not. Returns false when they span no area.
/// Source: Hartley and Zisserman, "Multiple view geometry", 2nd edition, algorithm 4.2.
bool fit_homography(const bundle &data, const bundle_view &view, homography *result);

/// The homography of a view as a pinhole with the focal length and the centre of a lens would see
/// it, so that wide lenses have one, too. Corners 80 degrees or more off the axis are left out.
bool fit_flat_homography(const bundle &data, int camera, const bundle_view &view,
                         const lens_state &lens, homography *result);

/// The pose that a homography implies for a camera without distortion.
bool pose_from_homography(const homography &seen, double focal_px, double centre_x_px,
                          double centre_y_px, rigid *T_camera_board);

/// Candidate initial focal lengths of one camera, best first, at most `max`: local minima of the
/// misfit of the best poses to the homographies, over a scan from 0.25 to 80 times the longer side
/// of the image. The closed form would need boards that are not parallel to the image.
std::vector<double> scan_focal_lengths(const lens_frame &frame, const std::vector<homography> &seen,
                                       size_t max);

/// The same for an equidistant lens: fields of view from 60 to 220 degrees over the longer side. A
/// view whose corners fit no board at a focal length counts as entirely wrong there.
std::vector<double> scan_equidistant(const bundle &alone, size_t max);

/// The pose of the right camera that most pairs agree on. `T_camera_board[camera][i]` are poses of
/// the boards in each camera's own frame; only `pairs` (positions used by both cameras) vote.
/// Returns for each pair the median error in px of its corners in the right image.
std::vector<double> vote_rig(const bundle &data, const lens_state &right,
                             const std::vector<rigid> (&T_camera_board)[CAMERAS],
                             const std::vector<size_t> &pairs, rigid *T_right_left);

}  // namespace calib

#endif

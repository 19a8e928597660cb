// SPDX-License-Identifier: Apache-2.0
/// What was seen of the boards, and what a calibration solved from it.
#ifndef VERGENCE_CALIB_BASE_SOLUTION_HPP
#define VERGENCE_CALIB_BASE_SOLUTION_HPP

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/base/board.hpp"
#include "calib/base/lens_scale.hpp"
#include "calib/base/rigid.hpp"
#include "stereo/geometry/calibration.h"

namespace calib {

class error_model;  // calib/solve/uncertainty.hpp

/// Positions of one camera's motors while a pair was taken, as means of readings.
struct zoom_axes {
    double zoom_counts = 0, focus_counts = 0, pan_rad = 0;
};

/// One pair: what the left camera (0) and the right one (1) saw of a board. A view without corners
/// counts as not taken.
struct capture {
    std::array<std::string, 2> name;  // names of the images, for reports; should be unique
    std::array<board_view, 2> view;
    // For a calibration of all zooms only:
    size_t board = 0;      // index in `zoom_observations::boards`
    int position = 0;      // captures with the same number show the board in the same place
    int visit = 0;         // captures with the same number were taken without a pan in between
    bool focused = false;  // both lenses were focused on the board's corner next to the middle
    std::array<zoom_axes, 2> axes{};
};

struct observations {
    board target;
    int cameras = 2;  // 1: everything of camera 1 is ignored
    std::array<int, 2> width_px{}, height_px{};
    std::vector<capture> captures;
};

struct solve_options {
    int threads = 1;
    /// The distortion is fixed to this; pixels and board are still chosen.
    std::optional<lens_model::kind> distortion;
    /// False: the model below is used without cross-validation.
    bool choose_model = true;
    lens_model model;
    board_model target;
    bool second_start = true;
    /// Receives a progress text for the user. Called often and may throw to end the work early; may
    /// be empty.
    std::function<void(const char *)> progress;
};

/// A corner that was rejected as an outlier.
struct rejected_corner {
    size_t capture;
    int camera, index;
    double off_px;
    std::string reason;
};

/// A view that was rejected as a whole. `repaired`: its corners were renumbered and it counts after
/// all.
struct rejected_view {
    size_t capture;
    int camera;
    bool repaired;
    std::string reason;
};

/// The residual of one corner: predicted minus seen.
struct corner_residual_px {
    size_t capture;
    int camera, index;
    double x_px, y_px;    // position where the corner was seen
    double dx_px, dy_px;  // residual
    double sigma_px;      // sigma used as weight: the given one combined with `fit_test::floor_px`
    bool used;
};

struct view_summary {
    bool used = false;
    int corners_used = 0;
    double rms_px = 0;  // RMS over the used corners, per point
};

/// One candidate of the model choice.
struct model_score {
    lens_model model;
    board_model target;
    double held_out_rms_px;  // RMS over the held-out views, per point
    double worse_than_best;  // mean difference to the best in squared sigma, per corner
    double worse_than_best_sigma;
    bool chosen;
};

/// Does the model explain the corners, or is there a pattern in the residuals?
struct fit_test {
    double image_z = 0;           // standard scores of the chi-square of mean residuals by
    double board_z = 0;           // image cell and by corner of the board
    double systematic_px = 0;     // RMS of the residuals in the image beyond noise
    double systematic_share = 0;  // share of the whole RMS that is beyond noise
    double sigma_ratio = 0;       // residual scale over the sigmas given with the corners
    /// Common error of all corners beyond the noise of their images (inexact prints, compressed
    /// images); added to the variance of each.
    double floor_px = 0;
    bool alarm = false;  // there is a pattern that noise does not explain
    /// Whether the board positions agree on lenses and rig: their variance over what corner noise
    /// explains, and its standard score (`board_scatter.hpp`).
    double scatter_ratio = 1, scatter_z = 0;
    bool scattered = false;
    /// Residuals with a pattern carry less information than their number suggests. With an alarm,
    /// or scattered positions, all error bars of the solution were widened by about this factor.
    double widened = 1;
};

/// Does the solver reach the same solution from another start?
struct start_test {
    bool done = false, agrees = false;
    double focal_difference_sigma = 0;  // largest over the cameras, in predicted sigmas
    double cost_ratio = 0;              // second start over first
};

/// Error bars that do not depend on the place in the image.
struct solution_sigmas {
    std::array<double, 2> focal_px{}, centre_x_px{}, centre_y_px{};
    double baseline_mm = 0;
    std::array<double, 3> rotation_rad{};  // rotation of the right camera about its own axes
    std::array<double, 3> translation_mm{};
};

/// How well a length across the view is known, as far as the calibration determines it.
struct length_test {
    double length_mm = 100, distance_mm = 0;  // the median distance of the boards
    double sigma_mm = 0;                      // 0: not determined
};

struct verdict {
    bool good = false;
    bool lens_outside_model = false;   // one of the reasons, which may cause the others
    std::string sentence;              // summary for the user: good or not, and why
    std::vector<std::string> reasons;  // what speaks against it, most important first
    std::vector<std::string> remarks;  // remarks that do not speak against it
};

struct solution {
    bool solved = false;  // false: only `verdict` and the rejections are valid
    calibration rig{};    // valid with two cameras only; has no id, date or note
    lens camera[2] = {};
    rigid T_right_left;
    lens_model model;
    bool model_given = false;  // the options gave the model: no other distortion was tried
    /// Many views do not fit the given model, and more do to the equidistant one.
    bool wider_than_model = false;
    board_model target;
    /// How the board deviates from the drawing, indexed by board_model. With x and y from its
    /// middle, a = 2 x / width and b = 2 y / height, its height is z = BEND_X a^2 + BEND_Y b^2 +
    /// TWIST a b; its rows are longer than drawn by STRETCH / width, its columns shorter by the
    /// same share.
    double warp_mm[board_model::PARAMETERS] = {0, 0, 0, 0};

    std::vector<rigid> T_left_board;  // poses by board position, in the board's frame of board.hpp
    std::vector<bool> board_known;
    std::vector<std::array<view_summary, 2>> views;
    std::vector<corner_residual_px> residuals;  // sorted by board position, camera and index
    std::vector<rejected_corner> rejected_corners;
    std::vector<rejected_view> rejected_views;

    double rms_px = 0;  // RMS over all used corners, per point
    double sigma0 = 0;  // estimated sigma of a corner over the one that weighted it
    double held_out_rms_px = 0;
    int captures_used = 0, pairs_used = 0;
    std::vector<model_score> scores;
    fit_test fit;
    start_test second_start;
    solution_sigmas sigma;
    length_test length;                         // determined for a pair only
    std::shared_ptr<const error_model> errors;  // input of uncertainty.hpp; null if not solved
    calib::verdict verdict;
};

}  // namespace calib

#endif

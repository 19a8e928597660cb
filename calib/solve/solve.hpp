// SPDX-License-Identifier: Apache-2.0
/// From corners to the calibration of a stereo pair, or of one camera alone: what was seen goes in,
/// lenses, rig, positions of the board, every blunder by name, error bars and a verdict come out.
/// The same input gives the same bytes, on any number of threads and in any order of the input.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_HPP

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

/// One position of the board: what the left camera (0) and the right one (1) saw of it. A view
/// without corners counts as not taken.
struct sighting {
    std::array<std::string, 2> name;  // of the images, for reports; best unique
    std::array<board_view, 2> view;
};

struct observations {
    board target;
    int cameras = 2;  // 1: everything of camera 1 is ignored
    std::array<int, 2> width_px{}, height_px{};
    std::vector<sighting> sightings;
};

struct solve_options {
    int threads = 1;
    /// The distortion is taken as it is; pixels and board are chosen all the same.
    std::optional<lens_model::kind> distortion;
    /// False: the model below is taken as it is, which saves the cross-validation.
    bool choose_model = true;
    lens_model model;
    board_model target;
    bool second_start = true;
    /// Told what is being done, for people, and asked often, so that it may throw to end the work
    /// early; may be empty.
    std::function<void(const char *)> progress;
};

/// A corner that was taken for a blunder.
struct rejected_corner {
    size_t sighting;
    int camera, index;
    double off_px;
    std::string reason;
};

/// A view that was taken for a blunder, as a whole. `repaired`: its corners were renumbered and it
/// counts after all.
struct rejected_view {
    size_t sighting;
    int camera;
    bool repaired;
    std::string reason;
};

/// What is left of one corner: predicted minus seen.
struct corner_residual_px {
    size_t sighting;
    int camera, index;
    double x_px, y_px;    // where it was seen
    double dx_px, dy_px;  // residual
    double sigma_px;      // as weighted: as given, and `fit_test::floor_px` with it
    bool used;
};

struct view_summary {
    bool used = false;
    int corners_used = 0;
    double rms_px = 0;  // per point, of the used corners
};

/// One line of the choice of the model.
struct model_score {
    lens_model model;
    board_model target;
    double held_out_rms_px;  // per point, over views that the lenses and the rig had not seen
    double worse_than_best;  // mean difference to the best in squared sigma, per corner
    double worse_than_best_sigma;
    bool chosen;
};

/// Does the model explain the corners, or is there a pattern left in the residuals?
struct fit_test {
    double image_z = 0;           // standard scores of the chi-square of mean residuals by
    double board_z = 0;           // image cell and by corner of the board
    double systematic_px = 0;     // rms of what is left in the image beyond noise
    double systematic_share = 0;  // of the whole rms
    double sigma_ratio = 0;       // residual scale over the sigmas that the corners came with
    /// What all corners are off by beyond the noise of their images (prints that are not exact,
    /// compressed images): added to the variance of each.
    double floor_px = 0;
    bool alarm = false;  // there is a pattern that noise does not make
    /// Whether the positions of the board agree on lenses and rig: the variance of these over what
    /// the noise of corners makes, and its standard score (`board_scatter.hpp`).
    double scatter_ratio = 1, scatter_z = 0;
    bool scattered = false;
    /// Residuals with a pattern tell less than their number says; with an alarm, or scattered
    /// positions, all error bars of the solution were widened by about this factor.
    double widened = 1;
};

/// Did the solver end in the same place from elsewhere?
struct start_test {
    bool done = false, agrees = false;
    double focal_difference_sigma = 0;  // largest over the cameras, in predicted sigmas
    double cost_ratio = 0;              // second start over first
};

/// Error bars that do not depend on where one looks.
struct solution_sigmas {
    std::array<double, 2> focal_px{}, centre_x_px{}, centre_y_px{};
    double baseline_mm = 0;
    std::array<double, 3> rotation_rad{};  // turn of the right camera about its own axes
    std::array<double, 3> translation_mm{};
};

struct verdict {
    bool good = false;
    std::string sentence;              // for people: good or not, and why
    std::vector<std::string> reasons;  // what speaks against it, biggest first
    std::vector<std::string> remarks;  // what is worth knowing and no reason against it
};

class error_model;  // uncertainty.hpp

struct solution {
    bool solved = false;  // false: only `verdict` and the rejections mean anything
    calibration rig{};    // with two cameras; without id, date and note
    lens camera[2] = {};
    rigid T_right_left;
    lens_model model;
    board_model target;
    /// How the board is not as it was drawn, by board_model's places. With x and y from its middle,
    /// a = 2 x / width and b = 2 y / height it stands at z = BEND_X a^2 + BEND_Y b^2 + TWIST a b;
    /// its rows are longer than drawn by STRETCH / width, its columns shorter by the same share.
    double warp_mm[board_model::PLACES] = {0, 0, 0, 0};

    std::vector<rigid> T_left_board;  // by sighting, board's frame as in board.hpp
    std::vector<bool> board_known;
    std::vector<std::array<view_summary, 2>> views;
    std::vector<corner_residual_px> residuals;  // by sighting, camera, index
    std::vector<rejected_corner> rejected_corners;
    std::vector<rejected_view> rejected_views;

    double rms_px = 0;  // per point, of all used corners
    double sigma0 = 0;  // estimated sigma of a corner over the one that weighted it
    double held_out_rms_px = 0;
    int sightings_used = 0, pairs_used = 0;
    std::vector<model_score> scores;
    fit_test fit;
    start_test second_start;
    solution_sigmas sigma;
    std::shared_ptr<const error_model> errors;  // for uncertainty.hpp; null when not solved
    calib::verdict verdict;
};

/// Solves. Never throws for what is wrong with the observations: the verdict says it.
solution solve(const observations &seen, const solve_options &options);

}  // namespace calib

#endif

// SPDX-License-Identifier: Apache-2.0
/// One look at the board: how well a calibration of all zooms holds at a pair's state, and the
/// calibration of that state corrected by the board's known size.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_TOUCH_UP_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_TOUCH_UP_HPP

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "stereo/geometry/calibration.h"
#include "stereo/zoom/adjust_target.h"
#include "tools/host/calibrate/calibrate_views.hpp"

/// How a board measures with a calibration, against how well that is predicted.
struct board_fit {
    double square_mm = 0, square_sigma_mm = 0;  // mean side of the squares
    double rows_px = 0, rows_sigma_px = 0;      // median distance from the epipolar lines
    double far_px = 0, far_sigma_px = 0;        // offset between the views of a thing at infinity

    /// Deviations in predicted standard deviations.
    double square_z(double true_mm) const;
    double rows_z() const;
    double far_z() const;
};

/// Marks that a person has picked in the pictures of one pair: columns and rows in the left
/// picture, then in the right one.
struct touch_up_marks {
    using place = std::array<double, 4>;
    double length_mm = 0;  // distance between the two marks; 0: no marks
    std::array<place, 2> mark{};
    bool far = false;  // `infinity` is a thing so far away that its distance does not matter
    place infinity{};

    bool any() const { return length_mm > 0 || far; }
};

/// What one pair shows.
struct touch_up_look {
    std::string name;                   // SESSION:N
    std::pair<size_t, uint32_t> order;  // order of capture: session, pair
    int corners = 0;     // corners that both cameras see; 0: only a thing at infinity
    bool marks = false;  // two marks instead of a board: the size is a length
    // The pair's own matches, and their median distance from the epipolar lines, refined by them
    // and corrected.
    int matches = 0;
    double own_rows_px = 0, own_rows_after_px = 0;
    bool own_apart = false;  // the correction moved the matches away from their epipolar lines
    board_fit read;          // fit of the cameras as the motors read
    board_fit fitted;        // fit after a correction by the rows, as any pair gets
    board_fit corrected;     // fit after a correction by the size of the board
    bool holds = true;       // all is as predicted
    double depth_mm = 0;
    double depth_sigma_mm = 0, fitted_depth_sigma_mm = 0, corrected_depth_sigma_mm = 0;
    calibration rig = {};  // calibration of the whole sensor, corrected by the size
};

/// A board, or two marks, where both cameras see it.
struct known_size {
    std::vector<std::array<double, 3>> points_mm;
    std::vector<target_observation> seen;  // on the sensors: left (view 0) and right (1) in turn
    double sigma_px = 0;

    bool is_enough() const;        // enough points to correct cameras by
    adjust_target target() const;  // refers to this
};

known_size known_size_find(const calibrate_shot &shot, const calib::board &board,
                           const calib::capture &capture);

/// The two marks as a board of two corners, of each shot.
calibrate_views touch_up_views(const touch_up_marks &marks,
                               const std::vector<calibrate_shot> &shots);

/// Looks at all pairs that show the board in both pictures, in the order taken; `*notes` names
/// those that cannot be used. `corrects`: their states are corrected by the size of the board, too.
/// False with one sentence in `*error` if the file is not a calibration of all zooms, or no pair
/// can be used.
bool calibrate_touch_up(const std::string &zoom_path, const std::vector<calibrate_shot> &shots,
                        const calibrate_views &views, const touch_up_marks &marks, bool corrects,
                        std::vector<touch_up_look> *looks, std::vector<std::string> *notes,
                        std::string *error);

/// `corrected`: with what the correction by the size of the board reaches. `square_mm` is the true
/// side of a square.
std::string touch_up_text(const std::vector<touch_up_look> &looks, bool corrected);
std::string touch_up_json(const std::vector<touch_up_look> &looks, double square_mm,
                          bool corrected);

/// What a look at a known size excludes.
struct touch_up_outcome {
    bool good = false;
    std::string sentence;  // "Good: ...", "Not good: ..." or "Undecided: ..."
    std::string reason;    // what is not good, without the first words of `sentence`
    // Shares of lengths: how far the best look is off, and the errors that it excludes.
    double off = 0, excluded = 0;
};

/// `corrected`: of the last look, whose calibration is written; else of all.
touch_up_outcome touch_up_verdict(const std::vector<touch_up_look> &looks, double square_mm,
                                  bool corrected);

#endif

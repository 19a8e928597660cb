// SPDX-License-Identifier: Apache-2.0
/// The result of a calibration for the user, for programs, and as our own text.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_RESULT_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_RESULT_HPP

#include <string>
#include <vector>

#include "calib/solve/solve.hpp"
#include "stereo/geometry/calibration.h"
#include "tools/host/calibrate/calibrate_views.hpp"

/// How far rows of the rectified pair differ where both cameras saw the same corner.
struct calibrate_rows {
    int corners = 0;
    double rms_px = 0, max_px = 0;  // pixels at the mean focal length
};

struct calibrate_result {
    const calibrate_views *views;
    const calib::solution *solution;
    calibration rig{};               // rounded, with id, date and note; pairs only
    calibrate_rows rows;             // pairs only
    std::vector<std::string> notes;  // what was left out
};

/// Vertical distance between rectified rows, over the corners that were used in both cameras.
calibrate_rows calibrate_rows_of(const calib::solution &solution);

/// The capture data of the used pairs: mean and spread of each axis, windows, cameras; unknown if a
/// pair does not belong to a session. Returns false with one sentence in `*error` when pairs are
/// inconsistent: an axis moved, or cameras or windows differ.
bool calibrate_origin_of(const std::vector<calibrate_shot> &shots, const calib::solution &solution,
                         calibration_origin *origin, std::string *error);

/// One line for each side whose servo position was not set when the pairs were taken.
std::vector<std::string> calibrate_origin_notes(const std::vector<calibrate_shot> &shots,
                                                const calibration_origin &origin);

/// The uncertainty of the solution in the middle of the image, as the two terms that
/// `calibration_depth_sigma_mm` adds: fitted at the boards' median distance and at twice that.
void calibrate_sigmas_of(const calib::solution &solution, calibration *rig);

/// The note of a calibration that is not good, as much of it as a calibration holds.
std::string calibrate_not_good_note(const std::string &reason, const std::string &note);

/// The rig as our own text. The note of a rig that is not good says so. `id` "" derives one from
/// the corners. Returns false with one sentence in `*error` when the text cannot hold it.
bool calibrate_rig_name(const std::string &id, const std::string &date, const std::string &note,
                        calibrate_result *result, std::string *error);

/// All figures, as JSON. Contains no clock time and no path of this machine.
std::string calibrate_result_json(const calibrate_result &result);

/// The main figures in a few lines, the verdict last.
std::string calibrate_result_text(const calibrate_result &result);

/// One line that names the pictures with overexposed white squares; otherwise empty.
std::vector<std::string> calibrate_result_overexposed(const calibrate_result &result);

/// Names the layout of a coded board that is not the present one of OpenCV; otherwise empty.
std::string calibrate_result_layout(const calibrate_result &result);

/// One line for each rejected view and corner, of corners only the worst.
std::vector<std::string> calibrate_result_rejections(const calibrate_result &result);

#endif

// SPDX-License-Identifier: Apache-2.0
/// What a calibration found, for people, for programs, and as our own text.
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
    double rms_px = 0, most_px = 0;  // at the mean focal length
};

struct calibrate_result {
    const calibrate_views *views;
    const calib::solution *solution;
    calibration rig{};               // with id, date and note; rounded. Of a pair only
    calibrate_rows rows;             // of a pair only
    std::vector<std::string> notes;  // what was left out
};

/// How far apart rectified rows are, over the corners that were used in both cameras.
calibrate_rows calibrate_rows_of(const calib::solution &solution);

/// What the pairs that count were taken with: the mean and the spread of each axis, the windows,
/// the cameras; not known where a pair is of no session. False with one sentence in `*error` when
/// pairs do not belong together: an axis moved, or they are of other cameras or windows.
bool calibrate_origin_of(const std::vector<calibrate_shot> &shots, const calib::solution &solution,
                         calibration_origin *origin, std::string *error);

/// One line for each side whose servo was not set when the pairs were taken.
std::vector<std::string> calibrate_origin_notes(const std::vector<calibrate_shot> &shots,
                                                const calibration_origin &origin);

/// What the solution leaves uncertain in the middle of the image, as the two terms that
/// `calibration_depth_sigma_mm` adds up: fitted at the boards' median distance and twice that.
void calibrate_sigmas_of(const calib::solution &solution, calibration *rig);

/// The rig as our own text has it. A rig that is not good says so in its note. `id` "" makes one
/// from the corners. Returns false with one sentence in `*error` when the text cannot hold it.
bool calibrate_rig_name(const std::string &id, const std::string &date, const std::string &note,
                        calibrate_result *result, std::string *error);

/// All figures, as JSON. No clock and no place of this machine is in it.
std::string calibrate_result_json(const calibrate_result &result);

/// The figures that matter, in some lines, the verdict last.
std::string calibrate_result_text(const calibrate_result &result);

/// One line that names the pictures whose white squares are overexposed; none when there is none.
std::vector<std::string> calibrate_result_overexposed(const calibrate_result &result);

/// One line for each view and corner that does not count, corners only the worst.
std::vector<std::string> calibrate_result_rejections(const calibrate_result &result);

#endif

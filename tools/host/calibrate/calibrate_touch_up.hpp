// SPDX-License-Identifier: Apache-2.0
/// One look at the board: how well a calibration of all zooms holds at a pair's state, and the
/// calibration of that state corrected by the board's known size.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_TOUCH_UP_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_TOUCH_UP_HPP

#include <string>
#include <vector>

#include "stereo/geometry/calibration.h"
#include "tools/host/calibrate/calibrate_views.hpp"

/// What one pair shows, before and after the correction.
struct touch_up_look {
    size_t shot = 0;
    int corners = 0;  // that both cameras see
    double square_mm = 0, square_sigma_mm = 0, rows_px = 0;
    bool holds = true;  // the squares are as long as predicted
    double corrected_square_mm = 0, corrected_rows_px = 0;
    double depth_mm = 0, depth_sigma_mm = 0, corrected_depth_sigma_mm = 0;
    calibration rig = {};  // of the whole sensor, corrected
};

/// Looks at all pairs that show the board in both pictures. False with one sentence in `*error` if
/// the file is not a calibration of all zooms, or no pair can be used.
bool calibrate_touch_up(const std::string &zoom_path, const std::vector<calibrate_shot> &shots,
                        const calibrate_views &views, std::vector<touch_up_look> *looks,
                        std::string *error);

std::string touch_up_text(const std::vector<touch_up_look> &looks);
std::string touch_up_json(const std::vector<touch_up_look> &looks);

#endif

// SPDX-License-Identifier: Apache-2.0
/// Recordings with several zooms: from the views of a board to the calibration of the whole rig.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_ZOOM_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_ZOOM_HPP

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "calib/zoom/zoom_expected.hpp"
#include "calib/zoom/zoom_solve.hpp"
#include "tools/host/calibrate/calibrate_views.hpp"

/// Whether the pairs were taken at so many zooms that the lenses are calibrated as functions of
/// them.
bool calibrate_zoom_is_wanted(const std::vector<calibrate_shot> &shots);

struct calibrate_zoom_job {
    const std::vector<calibrate_shot> *shots = nullptr;
    const calibrate_views *views = nullptr;
    int threads = 1;
    bool paper = false;  // each zoom alone, and straight lines
    std::string id, date, note;
    std::function<void(int step, int steps)> progress;

    // The result.
    calib::zoom_observations seen;
    std::vector<size_t> shot_of;  // index of the shot that each capture comes from
    calib::zoom_solution solution;
    std::array<calib::zoom_lengths, 2> lengths;  // not with `paper`
    session_corner_noise noise{};                // noise measured in still frames
    std::string verdict;                         // "Good: ..." or "Not good: ..."
};

/// Solves. Returns false with one sentence in `*error` when nothing can be calibrated.
bool calibrate_zoom_solve(calibrate_zoom_job *job, std::string *error);

/// The calibration as text, all figures as JSON, and the main ones in a few lines.
std::string calibrate_zoom_file(const calibrate_zoom_job &job);
std::string calibrate_zoom_json(const calibrate_zoom_job &job);
std::string calibrate_zoom_text(const calibrate_zoom_job &job);

/// One line for each picture that was left out, and for the worst corners.
std::vector<std::string> calibrate_zoom_notes(const calibrate_zoom_job &job);

#endif

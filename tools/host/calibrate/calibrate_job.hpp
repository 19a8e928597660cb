// SPDX-License-Identifier: Apache-2.0
/// One run of `vergence calibrate`: from named pictures to a directory of results.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_JOB_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_JOB_HPP

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calib/base/corner_cache.hpp"
#include "calib/base/lens_scale.hpp"
#include "tools/host/calibrate/calibrate_touch_up.hpp"

struct calibrate_job {
    calib::board board;
    calibrate_inputs inputs;
    std::vector<calib::cached_view> cache;
    std::optional<calib::lens_model::kind> distortion;  // unset: chosen automatically
    bool single = false;
    bool paper = false;    // several zooms: each alone, and straight lines
    int threads = 0;       // 0: all processors
    std::string out_path;  // "": nothing is written
    std::string id, date, note;
    std::string zoom;     // the calibration of all zooms to correct or verify; "": none
    bool verify = false;  // nothing is written
    touch_up_marks marks;
    /// As progress_expect and progress_show; may be empty.
    std::function<void(const double *work, int stages)> expect;
    std::function<void(int stage, const char *what, int done, int total)> progress;
};

struct calibrate_outcome {
    int code = 0;              // exit code, see option_page.h
    bool interrupted = false;  // by a signal, or by the callback of interrupt_ask
    std::string message;       // why it failed, or is not good; else the verdict
    std::vector<std::string> notes;
    // Only if it was solved, good or not:
    calibration rig{};       // pairs at one zoom
    std::string zoom_text;   // all zooms: the text of the calibration; "": one zoom
    std::string text, json;  // the summary; calibration.json
};

/// Runs it and prints nothing.
calibrate_outcome calibrate_job_run(const calibrate_job &job);

#endif

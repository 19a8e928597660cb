// SPDX-License-Identifier: Apache-2.0
/// One run of `vergence calibrate`: from named pictures to a directory of results.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_JOB_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_JOB_HPP

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
    bool single = false, json = false, quiet = false;
    bool paper = false;  // several zooms: each alone, and straight lines
    int threads = 0;     // 0: all processors
    std::string out_path, id, date, note;
    std::string zoom;     // the calibration of all zooms to correct or verify; "": none
    bool verify = false;  // nothing is written
    touch_up_marks marks;
};

/// Runs it, prints its output, and returns the exit code, see client.h.
int calibrate_job_run(const calibrate_job *job);

#endif

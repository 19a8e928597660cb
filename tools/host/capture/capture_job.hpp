// SPDX-License-Identifier: Apache-2.0
/// One run of `vergence calibrate capture`.
#ifndef VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_JOB_HPP
#define VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_JOB_HPP

#include <string>

#include "calib/base/board.hpp"

struct capture_job {
    const char *address = nullptr, *token = nullptr;  // null: the defaults
    std::string path;                                 // path of the session
    calib::board board;
    int zooms = 13, positions = 12;
    double f_number = 8;
    double near_mm = 800, far_mm = 2400;  // range in which boards are proposed
    double baseline_mm = 250;
    bool keep_window = false;
    bool autofocus = true;  // false: the focus follows the measured distance
    bool noise = true;      // measure the noise of a corner in still frames
    bool sweep = true;      // each position is also seen at other pans
};

/// Runs it, prints its output, and returns the exit code, see client.h.
int capture_job_run(const capture_job &job);

#endif

// SPDX-License-Identifier: Apache-2.0
/// calibration.html: one file that shows a calibration to the user: whether it is good, why, where
/// it is weak and what to photograph next. It needs no network and no other file.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_HPP

#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "calib/solve/solve.hpp"

struct calibration_page {
    const calib::observations *seen;
    const calib::solution *result;  // of these observations; may be unsolved
    std::string title;              // displayed only: may hold any text
    /// Loads one image, upright and grey, rows without gaps. Returns false if it is unavailable;
    /// the page then omits it. May be empty. Called for few images, once or twice each.
    std::function<bool(std::size_t capture, int camera, std::vector<std::uint8_t> *grey, int *width,
                       int *height)>
        load;
};

/// Writes the page: the same input gives the same bytes. Returns false when `out` fails.
bool calibration_report_write(const calibration_page &page, std::ostream &out);

#endif

// SPDX-License-Identifier: Apache-2.0
/// What calibration.html shows.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_PAGE_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_PAGE_HPP

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "calib/solve/solve.hpp"

struct calibration_page {
    const calib::observations *seen;
    const calib::solution *result;  // solution for `seen`; may be unsolved
    std::string title;              // displayed only: may hold any text
    /// Loads one image, upright and grey, rows without gaps. Returns false if it is unavailable;
    /// the page then omits it. May be empty. Called for few images, once or twice each.
    std::function<bool(std::size_t capture, int camera, std::vector<std::uint8_t> *grey, int *width,
                       int *height)>
        load;
};

#endif

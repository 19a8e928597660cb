// SPDX-License-Identifier: Apache-2.0
/// calibration.html: one file that shows a calibration to people: is it good, why, where it is weak
/// and what to photograph next. It needs no network and no other file.
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
    const calib::solution *result;  // of these observations; need not be solved
    std::string title;              // shown, not obeyed: may hold anything
    /// Loads one image, upright and grey, rows without gaps. Returns false when it cannot be had;
    /// the page then goes without. May be empty. Asked for few images, each once or twice.
    std::function<bool(std::size_t sighting, int camera, std::vector<std::uint8_t> *grey,
                       int *width, int *height)>
        load;
};

/// Writes the page: the same input gives the same bytes. Returns false when `out` fails.
bool calibration_report_write(const calibration_page &page, std::ostream &out);

#endif

// SPDX-License-Identifier: Apache-2.0
/// calibration.html of a rig with zooms: the lens functions against the motors' positions with
/// error bars, the depth that can be expected, the rig, and what was not used.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_ZOOM_REPORT_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_ZOOM_REPORT_HPP

#include <string>

#include "calib/zoom/zoom_solve.hpp"

struct zoom_page {
    const calib::zoom_observations *seen;
    const calib::zoom_solution *result;  // solved
    std::string verdict;                 // "Good: ..." or "Not good: ..."
};

/// The page as HTML: the same input gives the same bytes.
std::string zoom_report(const zoom_page &page);

/// Its parts.
std::string zoom_report_focal(const zoom_page &page);
std::string zoom_report_functions(const zoom_page &page);
std::string zoom_report_depth(const zoom_page &page);
std::string zoom_report_rig(const zoom_page &page);

/// One camera's lens at a zoom, focused and turned to the middle of what was calibrated; the other
/// camera likewise at its own zoom of the same share.
zoom_state zoom_report_state(const zoom_page &page, double share);

#endif

// SPDX-License-Identifier: Apache-2.0
/// calibration.html: one file that shows a calibration to the user: whether it is good, why, where
/// it is weak and what to photograph next. It needs no network and no other file.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_HPP

#include <ostream>

#include "tools/host/calibration_report/calibration_page.hpp"

/// Writes the page: the same input gives the same bytes. Returns false when `out` fails.
bool calibration_report_write(const calibration_page &page, std::ostream &out);

#endif

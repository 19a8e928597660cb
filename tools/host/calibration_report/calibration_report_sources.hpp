// SPDX-License-Identifier: Apache-2.0
/// The page's own sources (tools/host/calibration_report/), embedded at build time: see
/// tools/embed.cmake. The style sheet is appended to that of the reconstruction report.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_SOURCES_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_SOURCES_HPP

extern const char *const calibration_report_sources_page;
extern const char *const calibration_report_sources_style;
extern const char *const calibration_report_sources_script;

#endif

// SPDX-License-Identifier: Apache-2.0
/// The page's own sources (tools/host/calibration_report/), as the build embeds them: see
/// tools/embed.cmake. The style comes after that of the report of a reconstruction.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_SOURCES_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_SOURCES_HPP

extern const char *const calibration_report_sources_page;
extern const char *const calibration_report_sources_style;
extern const char *const calibration_report_sources_script;

#endif

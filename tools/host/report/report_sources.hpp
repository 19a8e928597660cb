// SPDX-License-Identifier: Apache-2.0
/// The page's own sources (tools/host/report/), embedded at build time: see tools/embed.cmake.
#ifndef VERGENCE_TOOLS_HOST_REPORT_REPORT_SOURCES_HPP
#define VERGENCE_TOOLS_HOST_REPORT_REPORT_SOURCES_HPP

extern const char *const report_sources_page;
extern const char *const report_sources_style;
extern const char *const report_sources_script;

#endif

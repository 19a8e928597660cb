// SPDX-License-Identifier: Apache-2.0
/// The sections of the page, as HTML. All but `rejected` need a solved solution and its figures.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_SECTIONS_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_SECTIONS_HPP

#include <string>

#include "tools/host/calibration_report/calibration_report_figures.hpp"

std::string calibration_report_verdict(const calib::solution &result);
std::string calibration_report_cards(const calibration_page &page,
                                     const calibration_figures &figures);
std::string calibration_report_hints(const calibration_figures &figures);
std::string calibration_report_coverage(const calibration_page &page,
                                        const calibration_figures &figures);
std::string calibration_report_residuals(const calibration_page &page,
                                         const calibration_figures &figures);
std::string calibration_report_views(const calibration_page &page);
std::string calibration_report_rejected(const calibration_page &page);
std::string calibration_report_uncertainty(const calibration_page &page,
                                           const calibration_figures &figures);
std::string calibration_report_pair(const calibration_page &page,
                                    const calibration_figures &figures);
std::string calibration_report_tables(const calibration_page &page,
                                      const calibration_figures &figures);

/// "left", "right"; "camera" if there is only one.
const char *calibration_report_side(const calibration_page &page, int camera);

/// File name of an image, HTML-escaped; its number where it has no name.
std::string calibration_report_image_name(const calibration_page &page, std::size_t capture,
                                          int camera);

#endif

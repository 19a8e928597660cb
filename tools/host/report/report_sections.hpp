// SPDX-License-Identifier: Apache-2.0
/// The sections of the page with figures, as HTML. External text is escaped here.
#ifndef VERGENCE_TOOLS_HOST_REPORT_REPORT_SECTIONS_HPP
#define VERGENCE_TOOLS_HOST_REPORT_REPORT_SECTIONS_HPP

#include <string>

#include "tools/host/report/report_figures.hpp"
#include "tools/host/report/report_layers.hpp"

std::string report_sections_cards(const reconstruct_context &context,
                                  const report_figures &figures);

/// Warnings and assumptions.
std::string report_sections_notes(const reconstruct_context &context,
                                  const report_figures &figures);

std::string report_sections_histogram(const report_figures &figures);

/// Errors against the ground truth, as a map and a table; empty without a usable ground truth.
std::string report_sections_accuracy(const reconstruct_context &context,
                                     const report_figures &figures, const report_grid &grid);

/// Tables: geometry, calibration, reasons, times and memory.
std::string report_sections_details(const reconstruct_context &context,
                                    const report_figures &figures);

/// The page's figures: pictures with captions, scales and legends, as HTML.

/// The rectified pair side by side, rows drawn across both.
std::string report_pictures_pair(const reconstruct_context &context, const report_grid &grid);

/// The raw images, for a pair that was rectified here; else empty.
std::string report_pictures_raw(const reconstruct_context &context);

/// Disparity, reasons, confidence and, if predicted, sigma.
std::string report_pictures_maps(const reconstruct_context &context, const report_figures &figures,
                                 const report_grid &grid);

/// Signed errors; requires a ground truth that can be compared.
std::string report_pictures_error(const reconstruct_context &context, const report_figures &figures,
                                  const report_grid &grid);

#endif

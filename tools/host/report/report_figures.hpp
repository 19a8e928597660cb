// SPDX-License-Identifier: Apache-2.0
/// The figures on the page, extracted from a result once.
#ifndef VERGENCE_TOOLS_HOST_REPORT_REPORT_FIGURES_HPP
#define VERGENCE_TOOLS_HOST_REPORT_REPORT_FIGURES_HPP

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/surface/result/reconstruct_context.h"
#include "tools/host/evaluate/evaluate.hpp"

/// Plain-language rating of a figure.
struct report_verdict {
    const char *word;      // "very good"
    const char *grade;     // CSS class: good, fair, bad or ""
    std::string sentence;  // what to do about it
};

/// Depths from low to high in equal steps, with the number of points per step.
struct report_histogram {
    double low_mm = 0, high_mm = 0;
    std::vector<std::size_t> counts;
    std::size_t nearer = 0, farther = 0;  // points outside the range
};

/// Ground truth in the pixels of the rectified left image.
struct report_truth {
    bool given = false;      // a file was named
    std::string last_error;  // why it cannot be compared; empty when it can
    std::vector<float> disparity_px;
    std::vector<std::uint8_t> mask;  // empty: none
    evaluate_result score;
};

struct report_figures {
    std::size_t pixels = 0, valid = 0, border = 0;
    double density_percent = 0;         // valid of all pixels
    double density_shared_percent = 0;  // valid among non-border pixels
    bool has_surface = false;
    double depth_p1_mm = 0, depth_median_mm = 0, depth_p99_mm = 0;
    double sigma_p2_mm = 0, sigma_median_mm = 0, sigma_p98_mm = 0;  // 0: not predicted
    double total_ms = 0;
    report_histogram histogram;
    report_verdict vertical;
    report_truth truth;
    const char *unit = "mm";  // unit of lengths; "units" when focal length or baseline are assumed
};

report_figures report_figures_collect(const reconstruct_context &context);

/// Mean of all values of a raw image in percent of the maximum; -1 when its pixels are unavailable.
double report_figures_brightness_percent(const raw_image &image);

/// Rates the |vertical disparity| of the matches, in px. `fault`: result_figures_rows_fault.
report_verdict report_figures_assess_rows(const triangulate_vertical &vertical, const char *fault);

#endif

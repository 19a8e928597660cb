// SPDX-License-Identifier: Apache-2.0
#include "tools/host/report/report_figures.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/base/process.h"
#include "daemon/surface/result/result_figures.h"
#include "tools/host/evaluate/evaluate.hpp"

namespace {

/// The value below which `share` of the sorted values are.
double quantile(const std::vector<double> &sorted, double share) {
    if (sorted.empty()) {
        return 0;
    }
    const double place = share * static_cast<double>(sorted.size() - 1);
    return sorted[static_cast<std::size_t>(std::lround(place))];
}

report_histogram histogram_of(const std::vector<double> &sorted_mm, std::size_t bins) {
    report_histogram histogram;
    // The middle 99 % with a margin: a few stray points must not compress the rest.
    const double low = quantile(sorted_mm, 0.005), high = quantile(sorted_mm, 0.995);
    const double margin = std::max(0.03 * (high - low), 1e-3);
    histogram.low_mm = std::max(0.0, low - margin);
    histogram.high_mm = high + margin;
    histogram.counts.assign(bins, 0);
    for (const double depth_mm : sorted_mm) {
        const double place = (depth_mm - histogram.low_mm) /
                             (histogram.high_mm - histogram.low_mm) * static_cast<double>(bins);
        if (place < 0) {
            histogram.nearer++;
        } else if (place >= static_cast<double>(bins)) {
            histogram.farther++;
        } else {
            histogram.counts[static_cast<std::size_t>(place)]++;
        }
    }
    return histogram;
}

void collect_lengths(const reconstruct_result &result, report_figures *figures) {
    std::vector<double> depths_mm, sigmas_mm;
    for (std::uint32_t i = 0; i < result.vertex_count; i++) {
        if (surface_figures_is_filled(&result, result.vertex_pixel[i])) {
            continue;
        }
        depths_mm.push_back(1e-3 * result.points[i].z_um);
        if (result.points[i].sigma_um > 0) {
            sigmas_mm.push_back(1e-3 * result.points[i].sigma_um);
        }
    }
    std::sort(depths_mm.begin(), depths_mm.end());
    if (interrupt_requested()) {
        return;  // sorting the points of a large result takes seconds
    }
    std::sort(sigmas_mm.begin(), sigmas_mm.end());
    figures->has_surface = result.vertex_count > 0;
    if (!figures->has_surface) {
        return;
    }
    figures->depth_p1_mm = quantile(depths_mm, 0.01);
    figures->depth_median_mm = quantile(depths_mm, 0.5);
    figures->depth_p99_mm = quantile(depths_mm, 0.99);
    figures->sigma_p2_mm = quantile(sigmas_mm, 0.02);
    figures->sigma_median_mm = quantile(sigmas_mm, 0.5);
    figures->sigma_p98_mm = quantile(sigmas_mm, 0.98);
    figures->histogram = histogram_of(depths_mm, 120);
}

void compare_with_truth(const reconstruct_context &context, report_truth *truth) {
    truth->given = context.ground_truth_path != nullptr;
    if (!truth->given) {
        return;
    }
    const reconstruct_result &result = *context.result;
    const int width = result.left.width, height = result.left.height;
    evaluate_truth loaded;
    if (!evaluate_truth_load(context.ground_truth_path,
                             context.mask_path != nullptr ? context.mask_path : "",
                             context.ground_truth_scale, &loaded, &truth->last_error)) {
        return;
    }
    if (loaded.width_px != width || loaded.height_px != height) {
        truth->last_error = "the ground truth is " + std::to_string(loaded.width_px) + "x" +
                            std::to_string(loaded.height_px) + ", the rectified left image " +
                            std::to_string(width) + "x" + std::to_string(height);
        return;
    }
    truth->disparity_px.swap(loaded.disparity_px);
    truth->mask.swap(loaded.mask);
    std::vector<float> disparity_px(truth->disparity_px.size());
    for (int y = 0; y < height; y++) {
        const std::int32_t *row = image_i32_row(&result.match.disparity_q8, y);
        const std::uint8_t *reason = image_u8_row(&result.match.reason, y);
        for (int x = 0; x < width; x++) {
            disparity_px[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(x)] =
                reason_has_disparity(reason[x]) ? static_cast<float>(row[x]) / 256.0F : INFINITY;
        }
    }
    evaluate_input input;
    input.width_px = width;
    input.height_px = height;
    input.disparity_px = disparity_px.data();
    input.truth_px = truth->disparity_px.data();
    input.mask = truth->mask.empty() ? nullptr : truth->mask.data();
    truth->score = evaluate_disparity(input);
}

/// Rows may fit where the depth does not: the word for both is that of the worse.
report_verdict with_cameras(const reconstruct_context &context, report_verdict rows) {
    if (!context.self_calibrated || std::string(rows.grade) == "bad") {
        return rows;
    }
    switch (context.self_calibration.health) {
        case ADJUST_CALIBRATE:
            return {"poor", "bad",
                    "The cameras are not where the calibration expects them: calibrate again."};
        case ADJUST_TOUCH_UP:
            return {"fair", "fair",
                    std::string("The pair does not show the depth well: correct it by a length") +
                        (context.with_pair_used ? " or a board."
                                                : ", a board or a pair at another zoom.")};
        default:
            return rows;
    }
}

}  // namespace

report_verdict report_figures_assess_rows(const triangulate_vertical &vertical, const char *fault) {
    const double median_px = vertical.median_px;
    // The matcher compares 5x5 windows row by row: up to a third of a pixel it loses nothing,
    // beyond a pixel it compares different content.
    if (vertical.samples == 0) {
        return {"not measured", "", "Too few textured matches to check the rows."};
    }
    if (fault != nullptr && median_px <= 0.8) {
        return {"fair", "fair", std::string("Calibrate again if accuracy matters: ") + fault};
    }
    if (median_px <= 0.15) {
        return {"very good", "good", "The calibration fits these images."};
    }
    if (median_px <= 0.35) {
        return {"good", "good", "The calibration fits these images well enough."};
    }
    if (median_px <= 0.8) {
        return {"fair", "fair", "Usable; calibrate again if accuracy matters."};
    }
    return {"poor", "bad", "The calibration does not fit these images: calibrate again."};
}

report_figures report_figures_collect(const reconstruct_context &context) {
    const reconstruct_result &result = *context.result;
    report_figures figures;
    figures.unit = context.metric ? "mm" : "units";
    figures.pixels =
        static_cast<std::size_t>(result.left.width) * static_cast<std::size_t>(result.left.height);
    figures.valid = result.reason_count[REASON_VALID] + result.reason_count[REASON_BEYOND];
    figures.border = result.reason_count[REASON_BORDER];
    const std::size_t shared = figures.pixels - figures.border;
    if (figures.pixels > 0) {
        figures.density_percent =
            100.0 * static_cast<double>(figures.valid) / static_cast<double>(figures.pixels);
    }
    if (shared > 0) {
        figures.density_shared_percent =
            100.0 * static_cast<double>(figures.valid) / static_cast<double>(shared);
    }
    for (const std::uint64_t stage_us : result.stage_us) {
        figures.total_ms += 1e-3 * static_cast<double>(stage_us);
    }
    collect_lengths(result, &figures);
    figures.vertical = with_cameras(
        context, report_figures_assess_rows(
                     result.vertical, result_figures_rows_fault(&result.vertical, &result.plan,
                                                                context.options->rectify.scale)));
    compare_with_truth(context, &figures.truth);
    return figures;
}

double report_figures_brightness_percent(const raw_image &image) {
    const std::size_t values =
        static_cast<std::size_t>(image.width_px) * (image.layout == RAW_RGB ? 3 : 1);
    if (image.data == nullptr || values == 0 || image.height_px <= 0) {
        return -1;
    }
    std::uint64_t sum = 0;
    for (int y = 0; y < image.height_px; y++) {
        const std::uint16_t *row = image.data + static_cast<std::ptrdiff_t>(y) * image.stride;
        for (std::size_t i = 0; i < values; i++) {
            sum += row[i];
        }
    }
    const double count = static_cast<double>(values) * image.height_px;
    return 100.0 * static_cast<double>(sum) / count / ((1 << image.bits) - 1);
}

// SPDX-License-Identifier: Apache-2.0
// The tables at the end of the page.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"
#include "tools/host/report/report_sections.hpp"

namespace {

std::string geometry_table(const reconstruct_context &context, const report_figures &figures) {
    const rectify_plan &plan = context.result->plan;
    std::string rows;
    rows +=
        page_row("rectified size", report_text_format("%d × %d px", plan.width_px, plan.height_px));
    rows += page_row("images", plan.identity ? "already rectified: used pixel for pixel"
                                             : "rectified from their calibration");
    if (context.shrink > 1) {
        rows += page_row("shrunk while reading", report_text_format("by %d", context.shrink));
    }
    rows += page_row("focal length", report_text_format("%.3f px", plan.f_px));
    rows += page_row("field of view",
                     report_text_format("%.1f° × %.1f°",
                                        report_field_deg(plan.cx_left_px, plan.width_px, plan.f_px),
                                        report_field_deg(plan.cy_px, plan.height_px, plan.fy_px)));
    rows += page_row("principal point, left",
                     report_text_format("%.3f, %.3f px", plan.cx_left_px, plan.cy_px));
    rows += page_row("principal point, right",
                     report_text_format("%.3f, %.3f px", plan.cx_right_px, plan.cy_px));
    rows += page_row("baseline", report_text_format("%.3f %s", plan.baseline_mm, figures.unit));
    rows += page_row("searched disparities",
                     report_text_format("%d to %d px", plan.disparity_min,
                                        plan.disparity_min + plan.disparity_count - 1));
    rows +=
        page_row("depths covered", report_text_length(plan.depth_near_mm, figures.unit) + " to " +
                                       (std::isfinite(plan.depth_far_mm)
                                            ? report_text_length(plan.depth_far_mm, figures.unit)
                                            : std::string("infinity")) +
                                       (plan.depth_range_assumed ? " (assumed)" : ""));
    if (figures.has_surface) {
        const double z = figures.depth_median_mm;
        rows += page_row("1 px at the median depth",
                         report_text_length(z * z / (plan.f_px * plan.baseline_mm), figures.unit) +
                             " in depth, " + report_text_length(z / plan.f_px, figures.unit) +
                             " across");
    }
    return page_table("Geometry", {}, rows);
}

std::string calibration_table(const reconstruct_context &context, const report_figures &figures) {
    const calibration *c = context.calibration;
    std::string rows;
    rows +=
        page_row("file", context.calibration_path != nullptr
                             ? report_text_escape(report_text_file_name(context.calibration_path))
                             : "none given");
    rows += page_row("format", report_text_escape(context.calibration_format));
    if (c != nullptr) {
        rows += page_row("id", report_text_escape(c->id));
        if (c->date[0] != '\0') {
            rows += page_row("date", report_text_escape(c->date));
        }
        rows += page_row("checksum", report_text_format("%08x", context.result->calibration_crc));
        if (c->rms_px > 0) {
            rows += page_row("reprojection rms", report_text_format("%.3f px", c->rms_px));
        }
        rows += page_row("lens models", report_text_format("%s, %s", lens_kind_name(c->left.kind),
                                                           lens_kind_name(c->right.kind)));
        const double *r = c->rotation_right_left_rad;
        const double turn_rad = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
        rows += page_row("angle between the cameras",
                         report_text_format("%.3f°", turn_rad * 57.29577951308232));
        const double *t = c->translation_right_left_mm;
        rows += page_row("left camera from the right one",
                         report_text_format("%.2f, %.2f, %.2f %s", t[0], t[1], t[2], figures.unit));
    }
    if (context.mismatch.text[0] != '\0') {
        rows += page_row("accepted mismatch", report_text_escape(context.mismatch.text));
    }
    if (context.depth_sigma_common_mm >= 0) {
        rows +=
            page_row("common sigma of all depths",
                     report_text_format("%.3g mm predicted at %.0f mm, from calibration and axes",
                                        context.depth_sigma_common_mm, figures.depth_median_mm));
    }
    if (context.self_calibrated) {
        const adjust_report &refined = context.self_calibration;
        rows += page_row("cameras, corrected by the pair",
                         report_text_format("%s; %d points, rows %.2f px before and %.2f px after",
                                            adjust_health_text(refined.health), refined.used,
                                            refined.rows_before_px, refined.rows_px));
        rows +=
            page_row("depth left uncertain by it",
                     report_text_format("%.3g mm at %.0f mm; before %.3g mm", refined.depth.after,
                                        refined.depth_mm, refined.depth.before));
    }
    if (context.target_points > 0) {
        rows += page_row("with a known size",
                         report_text_format("%d points; without it %.3g mm", context.target_points,
                                            context.without_target.depth.after));
    }
    if (context.with_pair_used) {
        rows +=
            page_row("second pair, pan stood still", "pair " + std::to_string(context.with_pair));
    }
    const triangulate_vertical &vertical = context.result->vertical;
    if (vertical.samples > 0) {
        rows += page_row("vertical disparity, matches measured",
                         report_text_count(static_cast<std::size_t>(vertical.samples)));
        rows += page_row("its offset", report_text_format("%+.3f px", vertical.offset_px));
        rows += page_row("its slopes along x, y",
                         report_text_format("%+.2e, %+.2e", vertical.slope_x, vertical.slope_y));
        rows += page_row("scatter about that", report_text_format("%.3f px rms", vertical.rms_px));
    }
    return page_table("Calibration", {}, rows);
}

/// Unknown for images that do not belong to a session.
std::string capture_table(const reconstruct_context &context) {
    static const char *const names[CAPTURE_INFO_LINES] = {"pair", "left camera", "right camera"};
    std::string rows;
    for (int line = 0; context.capture.session != nullptr && line < CAPTURE_INFO_LINES; line++) {
        char text[CAPTURE_INFO_BYTES];
        capture_info_line(&context.capture, line, text);
        rows += page_row(names[line], report_text_escape(text));
    }
    return rows.empty() ? rows : page_table("Capture", {}, rows);
}

/// What `measure` decided before it took the pair, and why: "aim: the subject is ...".
std::string decision_table(const reconstruct_context &context) {
    std::istringstream lines(context.decisions != nullptr ? context.decisions : "");
    std::string rows;
    for (std::string line; std::getline(lines, line);) {
        const std::size_t colon = std::min(line.find(": "), line.size());
        rows += page_row(report_text_escape(line.substr(0, colon)),
                         report_text_escape(line.substr(std::min(colon + 2, line.size()))));
    }
    return rows.empty() ? rows : page_table("Decisions", {}, rows);
}

std::string cost_table(const reconstruct_context &context, const report_figures &figures) {
    std::string rows;
    const std::uint64_t *stage_us = context.result->stage_us;
    const double max_us = static_cast<double>(
        std::max<std::uint64_t>(1, *std::max_element(stage_us, stage_us + RECONSTRUCT_STAGES)));
    for (int i = 0; i < RECONSTRUCT_STAGES; i++) {
        rows +=
            page_bar_row(reconstruct_stage_text(static_cast<reconstruct_stage>(i)),
                         static_cast<double>(stage_us[i]) / max_us,
                         report_text_format("%.1f ms", 1e-3 * static_cast<double>(stage_us[i])));
    }
    rows += page_bar_row("all stages", 0, report_text_format("%.1f ms", figures.total_ms));
    rows +=
        page_bar_row("reading files", 0,
                     report_text_format("%.1f ms", 1e-3 * static_cast<double>(context.read_us)));
    rows +=
        page_bar_row("memory, matching", 0, report_text_bytes(context.result->match_peak_bytes));
    rows +=
        page_bar_row("memory, all stages", 0, report_text_bytes(context.result->arena_peak_bytes));
    rows += page_bar_row("memory, process", 0, report_text_bytes(context.rss_peak_bytes));
    return page_table("Time and memory", {}, rows);
}

}  // namespace

std::string report_sections_details(const reconstruct_context &context,
                                    const report_figures &figures) {
    return decision_table(context) + capture_table(context) + geometry_table(context, figures) +
           calibration_table(context, figures) + cost_table(context, figures);
}

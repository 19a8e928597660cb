// SPDX-License-Identifier: Apache-2.0
#include "tools/host/report/report_sections.hpp"

#include <algorithm>
#include <vector>

#include "daemon/surface/result/result_figures.h"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

constexpr int last_tick = 6;

std::string rows_card(const reconstruct_context &context, const report_figures &figures) {
    const triangulate_vertical &vertical = context.result->vertical;
    std::string value = figures.vertical.word;
    std::string text = figures.vertical.sentence;
    if (vertical.samples > 0) {
        value += report_text_format(" <small>%.2f px</small>", vertical.median_px);
        text = report_text_format("median vertical disparity; 95 %% below %.2f px. ",
                                  vertical.p95_px) +
               text;
    }
    return page_card("Agreement of rows", value, text, figures.vertical.grade);
}

/// A column of the error table.
struct scored {
    const char *name;
    const evaluate_score *score;
};

std::string score_table(const std::vector<scored> &sets) {
    std::vector<std::string> heads = {"pixels"};
    for (const scored &set : sets) {
        heads.push_back(set.name);
    }
    const auto row = [&](const std::string &name, auto text) {
        std::vector<std::string> values;
        for (const scored &set : sets) {
            values.push_back(text(*set.score));
        }
        return page_row(name, values);
    };
    std::string rows =
        row("count", [](const evaluate_score &score) { return report_text_count(score.pixels); });
    for (int i = 0; i < EVALUATE_THRESHOLDS; i++) {
        rows += row(report_text_format("bad-%g", evaluate_thresholds_px[i]),
                    [i](const evaluate_score &score) {
                        return report_text_format("%.2f %%", score.bad_percent[i]);
                    });
    }
    rows += row("mean |error|", [](const evaluate_score &score) {
        return report_text_format("%.3f px", score.average_px);
    });
    rows += row("rms error", [](const evaluate_score &score) {
        return report_text_format("%.3f px", score.rms_px);
    });
    return page_table("", heads, rows);
}

/// The common deviation of all depths, which is not part of each point's own.
std::string common_text(const reconstruct_context &context, const report_figures &figures) {
    return context.depth_sigma_common_mm < 0
               ? ""
               : "; common to all points ± " +
                     report_text_length(context.depth_sigma_common_mm, figures.unit) +
                     " more, from calibration and axes";
}

/// The anchor that keeps the label of a tick of the histogram within the drawing.
const char *anchor_of(int tick) {
    if (tick == 0) {
        return "start";
    }
    return tick == last_tick ? "end" : "middle";
}

}  // namespace

std::string report_sections_cards(const reconstruct_context &context,
                                  const report_figures &figures) {
    const reconstruct_result &result = *context.result;
    std::string cards;
    cards += page_card(
        "Surface",
        report_text_count(surface_figures_measured_count(&result)) + " <small>points</small>",
        "joined by " + report_text_count(result.triangle_count) + " triangles");
    if (context.options->fill) {
        cards += page_card(
            "Filled",
            report_text_count(result.reason_count[REASON_FILLED]) + " <small>points</small>",
            "not measured, continued from the surface around; in the mesh files and the map "
            "of reasons only");
    }
    cards += page_card(
        "Measured", report_text_format("%.1f <small>%%</small>", figures.density_percent),
        report_text_format("of %d × %d pixels; %.1f %% of the area seen by both cameras",
                           result.left.width, result.left.height, figures.density_shared_percent));
    if (figures.has_surface) {
        cards += page_card("Depth", report_text_length(figures.depth_median_mm, figures.unit),
                           "median; " + report_text_length(figures.depth_p1_mm, figures.unit) +
                               " to " + report_text_length(figures.depth_p99_mm, figures.unit) +
                               " holds 98 % of the points");
    }
    if (figures.sigma_median_mm > 0) {
        cards += page_card(
            "Predicted sigma", "± " + report_text_length(figures.sigma_median_mm, figures.unit),
            "median standard deviation along the ray" + common_text(context, figures));
    }
    cards += rows_card(context, figures);
    cards +=
        page_card("Time and memory", report_text_format("%.0f <small>ms</small>", figures.total_ms),
                  report_text_format("%d thread%s, files not counted; ", context.threads,
                                     context.threads == 1 ? "" : "s") +
                      report_text_bytes(result.arena_peak_bytes) + ", of it " +
                      report_text_bytes(result.match_peak_bytes) + " to match");
    return cards;
}

std::string report_sections_notes(const reconstruct_context &context,
                                  const report_figures &figures) {
    std::string items;
    const std::string remark = context.calibration != nullptr ? context.calibration->note : "";
    bool remark_shown = remark.empty();
    bool truth_shown = figures.truth.last_error.empty();
    for (int i = 0; i < context.warning_count; i++) {
        const std::string text = context.warnings[i].text;
        remark_shown = remark_shown || text.find(remark) != std::string::npos;
        truth_shown = truth_shown || text.find(context.ground_truth_path) != std::string::npos;
        items += page_note("warning", "Note", text);
    }
    if (!remark_shown) {
        items += page_note("", "Calibration", remark);
    }
    if (!figures.has_surface) {
        items += page_note("warning", "No surface",
                           "No pixel could be measured. The map of reasons below shows why.");
    }
    if (!truth_shown) {
        items += page_note("warning", "Ground truth not used", figures.truth.last_error);
    }
    return page_notes(items);
}

std::string report_sections_histogram(const report_figures &figures) {
    if (!figures.has_surface) {
        return "<p class=\"lead\">No point was measured.</p>";
    }
    const report_histogram &histogram = figures.histogram;
    const std::size_t max = std::max<std::size_t>(
        1, *std::max_element(histogram.counts.begin(), histogram.counts.end()));
    const double width = 1200, height = 190, bins = static_cast<double>(histogram.counts.size());
    std::string svg = report_text_format(
        "<div class=\"panel\"><svg class=\"histogram\" viewBox=\"0 0 %.0f %.0f\" role=\"img\" "
        "aria-label=\"Histogram of depths\">\n",
        width, height + 30);
    const double step_mm = (histogram.high_mm - histogram.low_mm) / bins;
    for (std::size_t i = 0; i < histogram.counts.size(); i++) {
        const double share = static_cast<double>(histogram.counts[i]) / static_cast<double>(max);
        if (histogram.counts[i] == 0) {
            continue;
        }
        const double low_mm = histogram.low_mm + step_mm * static_cast<double>(i);
        svg += report_text_format(
            "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"><title>%s to %s: %s "
            "points</title></rect>\n",
            width * static_cast<double>(i) / bins, height * (1 - share), width / bins - 1,
            height * share, report_text_length(low_mm, figures.unit).c_str(),
            report_text_length(low_mm + step_mm, figures.unit).c_str(),
            report_text_count(histogram.counts[i]).c_str());
    }
    svg += report_text_format("<line x1=\"0\" x2=\"%.0f\" y1=\"%.1f\" y2=\"%.1f\"/>\n", width,
                              height + 0.5, height + 0.5);
    for (int i = 0; i <= last_tick; i++) {
        const double share = static_cast<double>(i) / last_tick;
        svg += report_text_format(
            "<text x=\"%.1f\" y=\"%.0f\" text-anchor=\"%s\">%s</text>\n", width * share,
            height + 22, anchor_of(i),
            report_text_length(histogram.low_mm + share * (histogram.high_mm - histogram.low_mm),
                               figures.unit)
                .c_str());
    }
    svg += "</svg>";
    if (histogram.nearer + histogram.farther > 0) {
        svg += report_text_format(
            "<p class=\"hint\">%s points are nearer and %s farther than this.</p>",
            report_text_count(histogram.nearer).c_str(),
            report_text_count(histogram.farther).c_str());
    }
    return svg + "</div>";
}

std::string report_sections_accuracy(const reconstruct_context &context,
                                     const report_figures &figures, const report_grid &grid) {
    if (!figures.truth.given || !figures.truth.last_error.empty()) {
        return "";
    }
    const evaluate_result &score = figures.truth.score;
    const bool masked = !figures.truth.mask.empty();
    std::vector<scored> sets;
    if (masked) {
        sets.push_back({"measured, seen by both", &score.kept_visible});
    }
    sets.push_back({"measured, all", &score.saved_all});
    if (masked) {
        sets.push_back({"filled, seen by both", &score.filled_visible});
    }
    sets.push_back({"filled, all", &score.filled_all});
    return page_section(
        "accuracy", "Against the ground truth",
        report_text_format(
            "<p class=\"lead\">Truth: %s%s. %.1f %% of the pixels with known truth were measured. "
            "<b>Bad-t</b> is the share of pixels whose error is above t px. "
            "<b>Filled</b> gives every rejected pixel the smaller of its nearest measured "
            "neighbours' "
            "disparities in the row, so that rejecting gains nothing.</p>\n"
            "<div class=\"grid two\">%s%s</div>\n",
            report_text_escape(report_text_file_name(context.ground_truth_path)).c_str(),
            masked ? "" : " (no mask of occluded pixels: all known pixels count)",
            score.density_all_percent, report_pictures_error(context, figures, grid).c_str(),
            score_table(sets).c_str()));
}

// SPDX-License-Identifier: Apache-2.0
// A pair of the calibration itself, rectified: corresponding points are on the same row.
#include <algorithm>
#include <cmath>

#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

const int PICTURE_WIDTH_PX = 900;

/// The pair whose corners cover most of the left image, with both views used.
bool best_pair(const calib::solution &result, std::size_t *best) {
    std::vector<std::array<double, 4>> box(result.views.size(), {INFINITY, INFINITY, 0, 0});
    for (const calib::corner_residual_px &corner : result.residuals) {
        if (corner.used && corner.camera == 0) {
            auto &b = box[corner.capture];
            b = {std::min(b[0], corner.x_px), std::min(b[1], corner.y_px),
                 std::max(b[2], corner.x_px), std::max(b[3], corner.y_px)};
        }
    }
    double max_px2 = 0;
    for (std::size_t i = 0; i < box.size(); i++) {
        const double area_px2 = (box[i][2] - box[i][0]) * (box[i][3] - box[i][1]);
        if (result.views[i][0].used && result.views[i][1].used && area_px2 > max_px2) {
            max_px2 = area_px2;
            *best = i;
        }
    }
    return max_px2 > 0;
}

std::string rows_over(int width_px, int height_px) {
    std::string path;
    for (int i = 1; i < 16; i++) {
        path += report_text_format("M0 %.1fH%d", i * height_px / 16.0, width_px);
    }
    return report_text_format(
        "<svg class=\"over\" viewBox=\"0 0 %d %d\" preserveAspectRatio=\"none\"><path "
        "class=\"epipolar\" d=\"%s\"/></svg><i class=\"row-hair\"></i>",
        width_px, height_px, path.c_str());
}

std::string pictures(const calibration_page &page, const calibration_figures &figures) {
    std::size_t capture = 0;
    calibration_picture raw[2];
    if (!figures.rectified_known || !best_pair(*page.result, &capture) ||
        !calibration_picture_load(page, capture, 0, &raw[0]) ||
        !calibration_picture_load(page, capture, 1, &raw[1])) {
        return "";
    }
    const calibration &rig = page.result->rig;
    const double scale = std::min(1.0, static_cast<double>(PICTURE_WIDTH_PX) / rig.left.width_px);
    std::string html = "<div class=\"pair\">\n";
    for (int side = 0; side < 2; side++) {
        const lens &own = side == 0 ? rig.left : rig.right;
        if (raw[side].width_px != own.width_px || raw[side].height_px != own.height_px) {
            return "";
        }
        const calibration_picture made =
            calibration_picture_rectify(raw[side], rig, figures.rectified, side, scale);
        html += report_text_format(
            "<div class=\"frame\"><img alt=\"Rectified %s image\" src=\"%s\">%s</div>\n",
            calibration_report_side(page, side), calibration_picture_jpeg(made).c_str(),
            rows_over(made.width_px, made.height_px).c_str());
    }
    return page_figure(
        html + "</div>\n",
        "<b>" + calibration_report_image_name(page, capture, 0) + "</b> and <b>" +
            calibration_report_image_name(page, capture, 1) +
            "</b>, rectified. Each line runs through the same points of both images. Point at an "
            "image to see its row in the other.");
}

std::string vertical_histogram(const calibration_figures &figures) {
    const int bins = 40;
    const double reach_px = calibration_report_round_up(
        std::max(1e-6, std::min(figures.vertical_max_px, 4 * figures.vertical_rms_px)));
    std::vector<std::size_t> counts(bins);
    std::size_t beyond = 0;
    for (const double off_px : figures.vertical_px) {
        const double place = (off_px + reach_px) / (2 * reach_px) * bins;
        if (place < 0 || place >= bins) {
            beyond++;
        } else {
            counts[static_cast<std::size_t>(place)]++;
        }
    }
    const auto max = static_cast<double>(*std::max_element(counts.begin(), counts.end()));
    calibration_report_plot plot({-reach_px, reach_px, false, "left row minus right row, px"},
                                 {0, 1.08 * std::max(1.0, max), false, "corners"});
    for (int i = 0; i < bins; i++) {
        const double low = -reach_px + 2 * reach_px * i / bins;
        const std::size_t count = counts[static_cast<std::size_t>(i)];
        plot.bar(low, low + 2 * reach_px / bins, static_cast<double>(count), "bar-fill",
                 report_text_format("%.3f to %.3f px: %zu", low, low + 2 * reach_px / bins, count));
    }
    return page_figure(
        plot.svg("Histogram of vertical disparities"),
        report_text_format(
            "<b>Vertical disparity</b> of %s corners seen by both cameras: %.3f px rms, at most "
            "%.2f px%s. In pixels of the raw images; matching searches along rows and needs "
            "them to agree.",
            report_text_count(figures.vertical_px.size()).c_str(), figures.vertical_rms_px,
            figures.vertical_max_px,
            beyond > 0 ? report_text_format(" (%zu beyond the drawing)", beyond).c_str() : ""));
}

std::string measured_table(const calibration_page &page, const calibration_figures &figures) {
    const calibration_measured &measured = figures.measured;
    if (measured.lengths == 0) {
        return "";
    }
    const double stated_mm = page.seen->target.square_mm;
    const double off_mm = measured.square_mean_mm - stated_mm;
    std::string rows = page_row("squares, stated side", report_text_format("%.4f mm", stated_mm)) +
                       page_row("squares, mean measured side",
                                report_text_format("%.4f mm (%+.3f %%)", measured.square_mean_mm,
                                                   100 * off_mm / stated_mm)) +
                       page_row("squares, rms error of a side",
                                report_text_format("%.4f mm", measured.square_rms_mm)) +
                       page_row("plane, rms height of corners",
                                report_text_format("%.4f mm", measured.plane_rms_mm)) +
                       page_row("sides measured", report_text_count(measured.lengths)) +
                       page_row("corners measured", report_text_count(measured.points));
    return page_table(
        "What the pair measures of its boards", {}, rows,
        std::string("<p class=\"hint\">Corners triangulated from both images, lengths between "
                    "neighbours, heights over each board's own plane of best fit") +
            (page.result->target.bent ? " (the board itself is bent, see below)" : "") + ".</p>");
}

}  // namespace

std::string calibration_report_pair(const calibration_page &page,
                                    const calibration_figures &figures) {
    if (page.seen->cameras == 1) {
        return "";
    }
    std::string html = pictures(page, figures) + "<div class=\"grid two\">\n";
    if (!figures.vertical_px.empty()) {
        html += vertical_histogram(figures);
    }
    return page_section("pair", "Rectified pair",
                        html + measured_table(page, figures) + "</div>\n");
}

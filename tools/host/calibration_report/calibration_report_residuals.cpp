// SPDX-License-Identifier: Apache-2.0
// Residuals of the solution: vectors over the image, against the radius, as a histogram, and by
// view.
#include <algorithm>
#include <cmath>

#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

const std::size_t MAX_MARKS = 5000;  // maximum in one plot; more would overlap anyway

/// Every n-th of the camera's corners is drawn.
std::size_t stride_of(const calibration_camera_figures &figures) {
    return (figures.corners.size() + MAX_MARKS - 1) / MAX_MARKS;
}

/// The image as a frame, and enlarged vectors from where each corner was seen.
std::string vectors(const calibration_page &page, const calibration_figures &figures, int camera) {
    const calibration_camera_figures &own = figures.camera[static_cast<std::size_t>(camera)];
    const double width_px = own.camera.width_px, height_px = own.camera.height_px;
    const double unit = width_px / 640;  // drawn sizes scale with the image
    const double enlarged =
        own.rms_px > 0 ? calibration_report_round_up(0.02 * width_px / own.rms_px) : 1;
    std::string lines, feet, rejected;
    for (std::size_t i = 0; i < own.corners.size(); i += stride_of(own)) {
        const calib::corner_residual_px &corner = *own.corners[i];
        if (!corner.used) {
            rejected += report_text_format("M%.1f %.1fh0", corner.x_px, corner.y_px);
            continue;
        }
        lines += report_text_format("M%.1f %.1fl%.1f %.1f", corner.x_px, corner.y_px,
                                    enlarged * corner.dx_px, enlarged * corner.dy_px);
        feet += report_text_format("M%.1f %.1fh0", corner.x_px, corner.y_px);
    }
    const double length_px = calibration_report_round_up(own.rms_px > 0 ? own.rms_px : 1);
    const double bar = length_px * enlarged;
    const std::string kind = camera == 0 ? "mark-a" : "mark-b";
    const std::string svg = report_text_format(
        "<svg class=\"field\" viewBox=\"-0.5 -0.5 %.0f %.0f\" role=\"img\" aria-label=\"Residual "
        "vectors of the %s camera\">\n"
        "<path class=\"axis-cross\" d=\"M%.1f 0V%.0fM0 %.1fH%.0f\" stroke-width=\"%.2f\"/>\n"
        "<path class=\"stroke %s\" stroke-width=\"%.2f\" d=\"%s\"/>\n"
        "<path class=\"dots %s\" stroke-width=\"%.2f\" d=\"%s\"/>\n"
        "<path class=\"dots mark-bad\" stroke-width=\"%.2f\" d=\"%s\"/>\n"
        "<path class=\"stroke mark-ink\" stroke-width=\"%.2f\" d=\"M%.1f %.1fh%.1f\"/>"
        "<text x=\"%.1f\" y=\"%.1f\" style=\"font-size:%.1fpx\">%g px</text></svg>\n",
        width_px, height_px, calibration_report_side(page, camera), own.camera.cx_px, height_px,
        own.camera.cy_px, width_px, unit, kind.c_str(), 1.4 * unit, lines.c_str(), kind.c_str(),
        3.2 * unit, feet.c_str(), 6 * unit, rejected.c_str(), 3 * unit, 12 * unit,
        height_px - 14 * unit, bar, 18 * unit + bar, height_px - 9 * unit, 15 * unit, length_px);
    return page_figure(
        svg, report_text_format(
                 "<b>Residuals, %s.</b> From each corner as seen towards where the model "
                 "predicts it, enlarged %g times; %.3f px rms. Patterns mean that the model misses "
                 "something. The cross is the principal point%s.",
                 calibration_report_side(page, camera), enlarged, own.rms_px,
                 rejected.empty() ? "" : "; red: rejected"));
}

struct radial {
    double radius_px, outward_px;
};

/// Radial residuals (predicted minus seen, outwards), with the mean over rings.
std::string radius_plot(const calibration_page &page, const calibration_figures &figures) {
    std::vector<radial> sides[2];
    double max_px = 1, sum = 0;
    std::size_t count = 0;
    for (int camera = 0; camera < figures.cameras; camera++) {
        const calibration_camera_figures &own = figures.camera[static_cast<std::size_t>(camera)];
        for (const calib::corner_residual_px *corner : own.corners) {
            if (!corner->used) {
                continue;
            }
            const double x = corner->x_px - own.camera.cx_px, y = corner->y_px - own.camera.cy_px;
            const double radius_px = std::hypot(x, y);
            const double outward_px =
                radius_px > 0 ? (x * corner->dx_px + y * corner->dy_px) / radius_px : 0;
            sides[camera].push_back({radius_px, outward_px});
            max_px = std::max(max_px, radius_px);
            sum += outward_px * outward_px;
            count++;
        }
    }
    const double reach_px =
        std::max(1e-6, 4 * std::sqrt(sum / std::max<double>(1, static_cast<double>(count))));
    calibration_report_plot plot({0, max_px, false, "distance from the principal point, px"},
                                 {-reach_px, reach_px, false, "residual outwards, px"});
    for (int camera = 0; camera < figures.cameras; camera++) {
        const std::size_t stride = (sides[camera].size() + MAX_MARKS - 1) / MAX_MARKS;
        calibration_report_points dots, means;
        for (std::size_t i = 0; i < sides[camera].size(); i += stride) {
            dots.push_back({sides[camera][i].radius_px, sides[camera][i].outward_px});
        }
        const int rings = 12;
        for (int ring = 0; ring < rings; ring++) {
            double ring_sum = 0;
            std::size_t inside = 0;
            for (const radial &one : sides[camera]) {
                if (static_cast<int>(rings * one.radius_px / (max_px * (1 + 1e-9))) == ring) {
                    ring_sum += one.outward_px;
                    inside++;
                }
            }
            if (inside >= 5) {
                means.push_back(
                    {(ring + 0.5) * max_px / rings, ring_sum / static_cast<double>(inside)});
            }
        }
        const char *kind = camera == 0 ? "mark-a" : "mark-b";
        plot.dots(dots, (std::string(kind) + " faint").c_str());
        plot.line(means, kind);
        plot.legend(kind, calibration_report_side(page, camera));
    }
    return page_figure(
        plot.svg("Residual against radius"),
        "<b>Residual against radius.</b> Dots are corners, lines their means by ring: a line that "
        "leaves zero is distortion outside the model.");
}

std::string histogram(const calibration_page &page, const calibration_figures &figures) {
    const int bins = 40;
    const double reach = 5;
    std::vector<std::size_t> counts(bins);
    std::size_t all = 0, beyond = 0;
    for (const calibration_camera_figures &own : figures.camera) {
        for (const calib::corner_residual_px *corner : own.corners) {
            const double sigma_px = corner->sigma_px * page.result->sigma0;
            if (!corner->used || !(sigma_px > 0)) {
                continue;
            }
            for (const double value : {corner->dx_px / sigma_px, corner->dy_px / sigma_px}) {
                all++;
                beyond += std::fabs(value) > 3 ? 1 : 0;
                const double place = (value + reach) / (2 * reach) * bins;
                counts[static_cast<std::size_t>(std::clamp(place, 0.0, bins - 0.5))]++;
            }
        }
    }
    if (all == 0) {
        return "";
    }
    const double width = 2 * reach / bins, total = static_cast<double>(all);
    const double gauss_max = 0.3989422804014327;
    const double max =
        std::max(gauss_max, static_cast<double>(*std::max_element(counts.begin(), counts.end())) /
                                total / width);
    calibration_report_plot plot({-reach, reach, false, "residual over its sigma"},
                                 {0, 1.08 * max, false, "density"});
    for (int i = 0; i < bins; i++) {
        const std::size_t count = counts[static_cast<std::size_t>(i)];
        const double low = -reach + i * width;
        plot.bar(low, low + width, static_cast<double>(count) / total / width, "bar-fill",
                 report_text_format("%.2f to %.2f: %zu", low, low + width, count));
    }
    calibration_report_points gauss;
    for (int i = 0; i <= 100; i++) {
        const double value = -reach + 2 * reach * i / 100;
        gauss.push_back({value, gauss_max * std::exp(-0.5 * value * value)});
    }
    plot.line(gauss, "mark-ink");
    plot.legend("mark-ink", "Gaussian");
    return page_figure(
        plot.svg("Histogram of residuals"),
        report_text_format(
            "<b>Histogram</b> of both components of all used corners, each over the "
            "sigma that it is weighted with. %.2f %% are beyond 3; 0.27 %% of Gaussian "
            "noise would be.",
            100 * static_cast<double>(beyond) / total));
}

std::string bar_cell(const calib::view_summary &view, double max_px, const char *kind) {
    if (!view.used) {
        return "<td class=\"bar\"></td><td>not used</td>";
    }
    return report_text_format(
        "<td class=\"bar\"><i class=\"%s\" style=\"width:%.1f%%\"></i></td><td>%.3f</td>", kind,
        100 * view.rms_px / max_px, view.rms_px);
}

}  // namespace

std::string calibration_report_residuals(const calibration_page &page,
                                         const calibration_figures &figures) {
    std::string html = "<div class=\"grid two\">\n";
    for (int camera = 0; camera < figures.cameras; camera++) {
        html += vectors(page, figures, camera);
    }
    return html + radius_plot(page, figures) + histogram(page, figures) + "</div>\n";
}

std::string calibration_report_views(const calibration_page &page) {
    const calib::solution &result = *page.result;
    double max_px = 1e-9;
    for (const auto &both : result.views) {
        for (const calib::view_summary &view : both) {
            max_px = std::max(max_px, view.used ? view.rms_px : 0);
        }
    }
    std::string rows;
    for (std::size_t i = 0; i < result.views.size(); i++) {
        rows += "<tr><th scope=\"row\">" + calibration_report_image_name(page, i, 0) + "</th>" +
                bar_cell(result.views[i][0], max_px, "bar-a");
        if (page.seen->cameras == 2) {
            rows += "<th scope=\"row\">" + calibration_report_image_name(page, i, 1) + "</th>" +
                    bar_cell(result.views[i][1], max_px, "bar-b");
        }
        rows += "</tr>\n";
    }
    std::vector<std::string> heads;
    for (int camera = 0; camera < page.seen->cameras; camera++) {
        heads.insert(heads.end(), {calibration_report_side(page, camera), "", "rms, px"});
    }
    return page_table("", heads, rows);
}

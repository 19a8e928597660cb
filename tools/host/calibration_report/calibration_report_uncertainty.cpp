// SPDX-License-Identifier: Apache-2.0
// Error bars over the image and over depth.
#include <algorithm>
#include <cmath>

#include "calib/solve/uncertainty.hpp"
#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"
#include "tools/host/report/report_layers.hpp"

namespace {

enum { MAP_COLUMNS = 64 };

/// Sigma of a direction over one camera's image.
struct sigma_map {
    int columns = MAP_COLUMNS, rows = 1;
    std::vector<double> sigma_px;  // negative: no ray
    double min_px = INFINITY, max_px = 0;
};

sigma_map measure_map(const calib::solution &result, int camera) {
    const lens &one = result.camera[camera];
    sigma_map map;
    map.rows = std::clamp(MAP_COLUMNS * one.height_px / one.width_px, 1, 4 * MAP_COLUMNS);
    for (int j = 0; j < map.rows; j++) {
        for (int i = 0; i < map.columns; i++) {
            const double sigma_px = calibration_figures_sigma_px(
                result, camera, (i + 0.5) / map.columns * one.width_px - 0.5,
                (j + 0.5) / map.rows * one.height_px - 0.5, INFINITY);
            map.sigma_px.push_back(sigma_px);
            if (sigma_px >= 0) {
                map.min_px = std::min(map.min_px, sigma_px);
                map.max_px = std::max(map.max_px, sigma_px);
            }
        }
    }
    return map;
}

/// The colour scale is logarithmic, as corners may be ten times less certain than the middle.
struct scale {
    double low_px, high_px;

    double share(double sigma_px) const {
        return std::clamp(std::log(sigma_px / low_px) / std::log(high_px / low_px), 0.0, 1.0);
    }
};

std::string scale_legend(const scale &range, const colormap_table &table) {
    page_ticks ticks;
    for (int i = 0; i <= 4; i++) {
        ticks.emplace_back(
            i / 4.0, report_text_format(
                         "%.2g%s", range.low_px * std::pow(range.high_px / range.low_px, i / 4.0),
                         i == 4 ? " px" : ""));
    }
    return page_scale(page_gradient(table), ticks);
}

std::string map_figure(const calibration_page &page, int camera, const sigma_map &map,
                       const scale &range, double distance_mm) {
    const colormap_table table = colormap_sequential();
    report_bytes indices;
    for (const double sigma_px : map.sigma_px) {
        const long index =
            sigma_px < 0 ? long{REPORT_TRANSPARENT} : std::lround(254 * range.share(sigma_px));
        indices.push_back(static_cast<unsigned char>(index));
    }
    const lens &one = page.result->camera[camera];
    const double middle_px[2] = {(one.width_px - 1) / 2.0, (one.height_px - 1) / 2.0};
    const double at_board_px = calibration_figures_sigma_px(
        *page.result, camera, middle_px[0], middle_px[1], std::max(distance_mm, 1.0));
    return page_figure(
        report_text_format("<div class=\"frame map smooth\"><img alt=\"Map of sigma\" "
                           "style=\"aspect-ratio:%d/%d\" src=\"%s\"></div>",
                           one.width_px, one.height_px,
                           report_encode_png(map.columns, map.rows, indices, table).c_str()),
        report_text_format(
            "<b>Projection, %s.</b> One sigma of the image position of a direction: %.3f px at "
            "best, %.2f "
            "px at worst; %.3f px in the middle for a point at the boards' distance.%s",
            calibration_report_side(page, camera), map.min_px, map.max_px, at_board_px,
            scale_legend(range, table).c_str()));
}

struct depth_curve {
    calibration_report_points points;  // depth, sigma
    double min_mm = INFINITY, max_mm = 0;
};

depth_curve measure_depth(const calib::solution &result, const double pixel_px[2], double near_mm,
                          double far_mm) {
    depth_curve curve;
    const int steps = 48;
    for (int i = 0; i <= steps; i++) {
        const double depth_mm =
            near_mm * std::pow(far_mm / near_mm, static_cast<double>(i) / steps);
        double sigma_mm = NAN;
        if (!result.errors->depth_sigma(pixel_px, depth_mm, &sigma_mm) || !(sigma_mm > 0)) {
            sigma_mm = NAN;
        } else {
            curve.min_mm = std::min(curve.min_mm, sigma_mm);
            curve.max_mm = std::max(curve.max_mm, sigma_mm);
        }
        curve.points.push_back({depth_mm, sigma_mm});
    }
    return curve;
}

/// Depth per tenth of a pixel of disparity, z^2 / (f B) each.
depth_curve matching_curve(const calib::solution &result, double near_mm, double far_mm) {
    depth_curve curve;
    const double f_b = result.camera[0].fx_px * calibration_baseline_mm(&result.rig);
    for (const double depth_mm : {near_mm, far_mm}) {
        const double sigma_mm = 0.1 * depth_mm * depth_mm / f_b;
        curve.points.push_back({depth_mm, sigma_mm});
        curve.min_mm = std::min(curve.min_mm, sigma_mm);
        curve.max_mm = std::max(curve.max_mm, sigma_mm);
    }
    return curve;
}

std::string depth_rows(const calib::solution &result, const double middle_px[2],
                       const double corner_px[2], double distance_mm) {
    std::string rows;
    for (const double factor : {0.3, 0.5, 1.0, 2.0, 5.0}) {
        const double depth_mm = factor * distance_mm;
        const auto cell = [&](const double pixel_px[2]) {
            double sigma_mm = 0;
            return result.errors->depth_sigma(pixel_px, depth_mm, &sigma_mm)
                       ? "± " + report_text_length(sigma_mm, "mm")
                       : std::string("not seen by both");
        };
        rows += page_row(report_text_length(depth_mm, "mm"), {cell(middle_px), cell(corner_px)});
    }
    return page_table("One sigma of depth", {"depth", "middle", "corner"}, rows);
}

std::string depth_figure(const calib::solution &result, const calibration_figures &figures) {
    const double distance_mm = figures.median_distance_mm;
    if (figures.cameras < 2 || !(distance_mm > 0)) {
        return "";
    }
    const lens &one = result.camera[0];
    const double middle_px[2] = {(one.width_px - 1) / 2.0, (one.height_px - 1) / 2.0};
    const double corner_px[2] = {0.9 * (one.width_px - 1), 0.9 * (one.height_px - 1)};
    const double near_mm = 0.3 * distance_mm, far_mm = 5 * distance_mm;
    const depth_curve middle = measure_depth(result, middle_px, near_mm, far_mm);
    const depth_curve corner = measure_depth(result, corner_px, near_mm, far_mm);
    const depth_curve matching = matching_curve(result, near_mm, far_mm);
    const double min_mm = std::min({middle.min_mm, corner.min_mm, matching.min_mm});
    const double max_mm = std::max({middle.max_mm, corner.max_mm, matching.max_mm});
    calibration_report_plot plot({near_mm, far_mm, true, "depth, mm"},
                                 {0.8 * min_mm, 1.25 * max_mm, true, "one sigma of depth, mm"},
                                 330);
    plot.line(matching.points, "mark-soft dashed");
    plot.line(middle.points, "mark-a");
    plot.line(corner.points, "mark-b");
    plot.legend("mark-a", "image's middle");
    plot.legend("mark-b", "corner");
    plot.legend("mark-soft dashed", "0.1 px of matching");
    return page_figure(
               plot.svg("Sigma of depth against depth"),
               "<b>Depth.</b> The calibration's share of the error of a measured depth, from 0.3 "
               "to "
               "5 times the boards' distance, in the middle of the left image and in a corner "
               "(nine "
               "tenths of the way from the top left). For comparison, what a tenth of a pixel of "
               "matching "
               "adds. A line ends where the right camera no longer sees the point.") +
           depth_rows(result, middle_px, corner_px, distance_mm);
}

}  // namespace

std::string calibration_report_uncertainty(const calibration_page &page,
                                           const calibration_figures &figures) {
    const calib::solution &result = *page.result;
    if (result.errors == nullptr) {
        return "<p class=\"lead\">Not known.</p>";
    }
    std::vector<sigma_map> maps;
    scale range{INFINITY, 0};
    for (int camera = 0; camera < figures.cameras; camera++) {
        maps.push_back(measure_map(result, camera));
        range.low_px = std::min(range.low_px, maps.back().min_px);
        range.high_px = std::max(range.high_px, maps.back().max_px);
    }
    std::string html = "<div class=\"grid two\">\n";
    if (range.low_px > 0 && range.high_px > 0 && std::isfinite(range.low_px)) {
        range.high_px = std::max(range.high_px, 1.01 * range.low_px);
        for (int camera = 0; camera < figures.cameras; camera++) {
            html += map_figure(page, camera, maps[static_cast<std::size_t>(camera)], range,
                               figures.median_distance_mm);
        }
    }
    return html + depth_figure(result, figures) + "</div>\n";
}

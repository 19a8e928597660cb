// SPDX-License-Identifier: Apache-2.0
// Where the corners are, how the boards were posed, and what was not used.
#include <algorithm>
#include <cmath>
#include <map>

#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

const std::size_t MAX_PICTURES = 24;  // most rejected views shown: limits the size of the page
const int PICTURE_WIDTH_PX = 260;

std::string coverage_map(const calibration_page &page, const calibration_figures &figures,
                         int camera) {
    const calibration_camera_figures &own = figures.camera[static_cast<std::size_t>(camera)];
    const double width_px = own.camera.width_px, height_px = own.camera.height_px;
    const double cell_x = width_px / CALIBRATION_AREAS_X, cell_y = height_px / CALIBRATION_AREAS_Y;
    const double typical =
        std::max(1.0, static_cast<double>(own.used) / (CALIBRATION_AREAS_X * CALIBRATION_AREAS_Y));
    std::string svg = report_text_format(
        "<svg class=\"field\" viewBox=\"-0.5 -0.5 %.0f %.0f\" role=\"img\" aria-label=\"Corners in "
        "the image of the %s camera\">\n",
        width_px, height_px, calibration_report_side(page, camera));
    for (int row = 0; row < CALIBRATION_AREAS_Y; row++) {
        for (int column = 0; column < CALIBRATION_AREAS_X; column++) {
            const int count = own.count[row][column];
            svg += report_text_format(
                "<rect class=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" "
                "fill-opacity=\"%.2f\"><title>%d corners</title></rect>\n",
                count > 0 ? "area-full" : "area-empty", column * cell_x - 0.5, row * cell_y - 0.5,
                cell_x, cell_y, count > 0 ? 0.12 + 0.4 * std::min(1.0, count / typical / 2) : 0.16,
                count);
        }
    }
    std::string dots;
    const std::size_t stride = own.corners.size() / 5000 + 1;
    for (std::size_t i = 0; i < own.corners.size(); i += stride) {
        if (own.corners[i]->used) {
            dots += report_text_format("M%.1f %.1fh0", own.corners[i]->x_px, own.corners[i]->y_px);
        }
    }
    svg +=
        report_text_format("<path class=\"dots %s\" stroke-width=\"%.2f\" d=\"%s\"/></svg>\n",
                           camera == 0 ? "mark-a" : "mark-b", 3.5 * width_px / 640, dots.c_str());
    return page_figure(
        svg, report_text_format("<b>Coverage, %s.</b> %s used corners; %d of %d areas (red) have "
                                "none.",
                                calibration_report_side(page, camera),
                                report_text_count(own.used).c_str(), own.empty_areas,
                                CALIBRATION_AREAS_X * CALIBRATION_AREAS_Y));
}

std::string tilt_plot(const calibration_figures &figures) {
    double reach_deg = 56;
    calibration_report_points dots;
    for (const calibration_pose &pose : figures.camera[0].poses) {
        dots.push_back({-pose.turn_deg, pose.nod_deg});
        reach_deg =
            std::max({reach_deg, 0.8 * std::fabs(pose.turn_deg), 1.15 * std::fabs(pose.nod_deg)});
    }
    // Sides in the proportion of the drawing, so that rings are round.
    calibration_report_plot plot(
        {-1.5 * reach_deg, 1.5 * reach_deg, false, "left edge away  ←  turn, degrees  →  right"},
        {-reach_deg, reach_deg, false, "nod, degrees"}, 330);
    for (const double ring : {15.0, 30.0, 45.0}) {
        plot.circle(0, 0, ring, "mark-soft");
    }
    plot.text(0, 0.89 * reach_deg, "top edge away", "middle");
    plot.text(0, -0.95 * reach_deg, "bottom edge away", "middle");
    plot.dots(dots, "mark-a big");
    return page_figure(
        plot.svg("Tilts of the boards"),
        "<b>Tilts</b> of the boards against the line of sight of the first camera; rings at 15, 30 "
        "and 45 degrees. Good sets have dots on all sides, between the rings.");
}

std::string distance_plot(const calibration_figures &figures) {
    double near_mm = INFINITY, far_mm = 0, max_deg = 30;
    calibration_report_points dots;
    for (const calibration_pose &pose : figures.camera[0].poses) {
        near_mm = std::min(near_mm, pose.distance_mm);
        far_mm = std::max(far_mm, pose.distance_mm);
        max_deg = std::max(max_deg, pose.tilt_deg);
        dots.push_back({pose.distance_mm, pose.tilt_deg});
    }
    if (dots.empty()) {
        return "";
    }
    const double margin_mm = std::max(0.1 * near_mm, 0.12 * (far_mm - near_mm));
    calibration_report_plot plot(
        {std::max(0.0, near_mm - margin_mm), far_mm + margin_mm, false, "distance, mm"},
        {0, 1.1 * max_deg, false, "tilt, degrees"}, 330);
    plot.dots(dots, "mark-a big");
    return page_figure(
        plot.svg("Distance and tilt of the boards"),
        report_text_format("<b>Distance and tilt.</b> Boards at %s to %s. Different distances and "
                           "tilts separate the focal length from the distance.",
                           report_text_length(near_mm, "mm").c_str(),
                           report_text_length(far_mm, "mm").c_str()));
}

/// Everything reported about one image.
struct defect {
    std::vector<std::string> sentences;
    std::vector<std::pair<double, double>> marks_px;
};

using defects = std::map<std::pair<std::size_t, int>, defect>;

void add_corners(const calib::solution &result, defects *all) {
    std::map<std::pair<std::size_t, int>, std::map<int, const calib::corner_residual_px *>> seen;
    for (const calib::corner_residual_px &corner : result.residuals) {
        if (!corner.used) {
            seen[{corner.capture, corner.camera}][corner.index] = &corner;
        }
    }
    for (const calib::rejected_corner &corner : result.rejected_corners) {
        defect &one = (*all)[{corner.capture, corner.camera}];
        if (one.sentences.size() < 6) {
            one.sentences.push_back(
                report_text_format("Corner %d, %.1f px off: ", corner.index, corner.off_px) +
                corner.reason);
        } else if (one.sentences.size() == 6) {
            one.sentences.push_back("More corners of this image were rejected likewise");
        }
        const auto &corners = seen[{corner.capture, corner.camera}];
        const auto found = corners.find(corner.index);
        if (found != corners.end()) {
            one.marks_px.push_back({found->second->x_px, found->second->y_px});
        }
    }
}

defects collect_errors(const calibration_page &page) {
    defects all;
    for (std::size_t i = 0; i < page.seen->captures.size(); i++) {
        for (int camera = 0; camera < page.seen->cameras; camera++) {
            const auto &view = page.seen->captures[i].view[static_cast<std::size_t>(camera)];
            if (!view.rejection.empty()) {
                all[{i, camera}].sentences.push_back(view.rejection);
            }
        }
    }
    for (const calib::rejected_view &view : page.result->rejected_views) {
        all[{view.capture, view.camera}].sentences.push_back(
            (view.repaired ? "Renumbered and used: " : "Rejected: ") + view.reason);
    }
    add_corners(*page.result, &all);
    return all;
}

std::string disturbance_figure(const calibration_page &page, std::size_t capture, int camera,
                               const defect &what, bool with_picture) {
    std::string words;
    for (const std::string &sentence : what.sentences) {
        words += "<br>" + report_text_escape(sentence) + ".";
    }
    calibration_picture picture;
    std::string shown;
    if (with_picture && calibration_picture_load(page, capture, camera, &picture)) {
        std::string marks;
        for (const auto &mark : what.marks_px) {
            marks += report_text_format("M%.1f %.1fh0", mark.first, mark.second);
        }
        shown = report_text_format(
            "<div class=\"frame\"><img alt=\"\" src=\"%s\">"
            "<svg class=\"over\" viewBox=\"-0.5 -0.5 %d %d\"><path class=\"dots mark-bad\" "
            "stroke-width=\"%.1f\" d=\"%s\"/></svg></div>",
            calibration_picture_jpeg(calibration_picture_shrink(picture, PICTURE_WIDTH_PX)).c_str(),
            picture.width_px, picture.height_px, picture.width_px / 30.0, marks.c_str());
    }
    return page_figure(shown, "<b>" + calibration_report_image_name(page, capture, camera) +
                                  "</b> (" + calibration_report_side(page, camera) + ")" + words);
}

}  // namespace

std::string calibration_report_coverage(const calibration_page &page,
                                        const calibration_figures &figures) {
    std::string html = "<div class=\"grid two\">\n";
    for (int camera = 0; camera < figures.cameras; camera++) {
        html += coverage_map(page, figures, camera);
    }
    return html + tilt_plot(figures) + distance_plot(figures) + "</div>\n";
}

std::string calibration_report_rejected(const calibration_page &page) {
    const defects all = collect_errors(page);
    if (all.empty()) {
        return "<p class=\"lead\">Nothing: every image and every corner counts.</p>\n";
    }
    std::string html = "<div class=\"grid small\">\n";
    std::size_t shown = 0;
    for (const auto &one : all) {
        html += disturbance_figure(page, one.first.first, one.first.second, one.second,
                                   shown++ < MAX_PICTURES);
    }
    return html + "</div>\n";
}

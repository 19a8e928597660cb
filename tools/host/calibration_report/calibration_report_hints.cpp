// SPDX-License-Identifier: Apache-2.0
// What to photograph next: image areas, tilts and distances that the boards do not cover.
#include <algorithm>
#include <cmath>

#include "tools/host/calibration_report/calibration_report_figures.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

const int DEFAULT_POSITIONS = 12;   // positions of the board that a calibration should have
const double TILT_ENOUGH_DEG = 15;  // a board turned this far separates focal length from distance
const double DEPTH_ENOUGH = 1.3;    // farthest over nearest board

const char *const area_names[3][3] = {{"top left", "top", "top right"},
                                      {"left side", "middle", "right side"},
                                      {"bottom left", "bottom", "bottom right"}};

const char *camera_name(int cameras, int camera) {
    if (cameras == 1) {
        return "the image";
    }
    return camera == 0 ? "the left image" : "the right image";
}

/// A ninth of one camera's image.
struct area {
    int camera, row, column;
    std::size_t corners;
    double sigma_px;  // predicted at its outer end; negative: unknown
};

std::string area_text(const calibration_figures &figures, const area &where) {
    return std::string("the ") + area_names[where.row][where.column] + " of " +
           camera_name(figures.cameras, where.camera);
}

area measure_area(const calib::solution &result, const calibration_figures &figures, int camera,
                  int row, int column) {
    const calibration_camera_figures &own = figures.camera[static_cast<std::size_t>(camera)];
    const double width_px = own.camera.width_px, height_px = own.camera.height_px;
    area found{camera, row, column, 0, 0};
    for (const calib::corner_residual_px *corner : own.corners) {
        const int i = static_cast<int>(3 * (corner->x_px + 0.5) / width_px);
        const int j = static_cast<int>(3 * (corner->y_px + 0.5) / height_px);
        found.corners += corner->used && i == column && j == row ? 1 : 0;
    }
    const double ends[3] = {0.05, 0.5, 0.95};
    found.sigma_px = calibration_figures_sigma_px(result, camera, ends[column] * (width_px - 1),
                                                  ends[row] * (height_px - 1), INFINITY);
    return found;
}

/// The area with the fewest corners; on a tie, the one with the largest uncertainty.
area weakest_area(const calib::solution &result, const calibration_figures &figures) {
    area weakest{0, 1, 1, static_cast<std::size_t>(-1), 0};
    for (int camera = 0; camera < figures.cameras; camera++) {
        for (int place = 0; place < 9; place++) {
            const area next = measure_area(result, figures, camera, place / 3, place % 3);
            if (next.corners < weakest.corners ||
                (next.corners == weakest.corners && next.sigma_px > weakest.sigma_px)) {
                weakest = next;
            }
        }
    }
    return weakest;
}

/// The direction in which the boards were tilted least.
struct tilt {
    const char *edge;  // the edge that points away
    double max_deg;
};

tilt missing_tilt(const calibration_figures &figures) {
    tilt ways[4] = {{"left", 0}, {"right", 0}, {"top", 0}, {"bottom", 0}};
    for (const calibration_pose &pose : figures.camera[0].poses) {
        ways[0].max_deg = std::max(ways[0].max_deg, pose.turn_deg);
        ways[1].max_deg = std::max(ways[1].max_deg, -pose.turn_deg);
        ways[2].max_deg = std::max(ways[2].max_deg, pose.nod_deg);
        ways[3].max_deg = std::max(ways[3].max_deg, -pose.nod_deg);
    }
    return *std::min_element(ways, ways + 4,
                             [](const tilt &a, const tilt &b) { return a.max_deg < b.max_deg; });
}

struct range {
    double near_mm, far_mm;
};

range distances(const calibration_figures &figures) {
    range found{INFINITY, 0};
    for (const calibration_pose &pose : figures.camera[0].poses) {
        found.near_mm = std::min(found.near_mm, pose.distance_mm);
        found.far_mm = std::max(found.far_mm, pose.distance_mm);
    }
    return found;
}

std::string length_text(double length_mm) {
    // A board cannot be held to the millimetre.
    return length_mm < 1000 ? report_text_format("%.0f mm", 10 * std::round(length_mm / 10))
                            : report_text_format("%.1f m", length_mm / 1000);
}

std::string area_hint(const calibration_figures &figures, const area &where, double typical) {
    const std::string sigma =
        where.sigma_px >= 0
            ? report_text_format(" A direction is known there to %.2f px (one sigma).",
                                 where.sigma_px)
            : std::string();
    if (where.corners == 0) {
        return "There is no corner in " + area_text(figures, where) +
               ", so the lens is guessed there." + sigma;
    }
    if (static_cast<double>(where.corners) < 0.35 * typical) {
        return "Only few corners (" + report_text_count(where.corners) + ") are in " +
               area_text(figures, where) + "." + sigma;
    }
    return "";
}

}  // namespace

std::vector<std::string> calibration_figures_hints(const calib::observations &,
                                                   const calib::solution &result,
                                                   const calibration_figures &figures) {
    if (figures.camera[0].poses.empty()) {
        return {};
    }
    const area weakest = weakest_area(result, figures);
    const tilt tilted = missing_tilt(figures);
    const range depth = distances(figures);
    const std::size_t corners = figures.camera[static_cast<std::size_t>(weakest.camera)].used;
    const std::string area_words = area_hint(figures, weakest, static_cast<double>(corners) / 9);
    const bool flat = tilted.max_deg < TILT_ENOUGH_DEG;
    const bool shallow = depth.far_mm < DEPTH_ENOUGH * depth.near_mm;
    const bool few = result.captures_used < DEFAULT_POSITIONS;
    const bool complete = area_words.empty() && !flat && !shallow && !few;

    // The single most useful picture, then why.
    const double distance_mm =
        shallow ? 0.75 * depth.near_mm : std::sqrt(depth.near_mm * depth.far_mm);
    std::vector<std::string> hints;
    hints.push_back(
        (complete ? std::string("The set is complete. The most useful additional picture is "
                                "with the board in ")
                  : std::string("Next: the board in ")) +
        area_text(figures, weakest) + ", its " + tilted.edge +
        " edge tilted away by 30 to 40 degrees, at about " + length_text(distance_mm) + ".");
    if (few) {
        hints.push_back(report_text_format(
            "%d board positions are used; take %d more: each lowers all error bars.",
            result.captures_used, DEFAULT_POSITIONS - result.captures_used));
    }
    if (!area_words.empty()) {
        hints.push_back(area_words);
    }
    if (flat) {
        hints.push_back(report_text_format(
            "The %s edge was never tilted away by more than %.0f degrees: boards that face the "
            "camera carry little information about the focal length.",
            tilted.edge, tilted.max_deg));
    }
    if (shallow) {
        hints.push_back("All boards are at " + length_text(depth.near_mm) + " to " +
                        length_text(depth.far_mm) +
                        ": take some nearer or farther, as long as they stay sharp.");
    }
    return hints;
}

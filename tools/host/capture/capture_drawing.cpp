// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "tools/host/capture/capture_plan.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

const double tile = 116, gap = 8, left_margin = 70, top = 56;
const char *const colours[2] = {"#1f6fb4", "#c8501e"};

std::string line(double x1, double y1, double x2, double y2, const char *style) {
    return report_text_format("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" %s/>\n", x1,
                              y1, x2, y2, style);
}

std::string label(double x, double y, const std::string &text, const char *style = "") {
    return report_text_format("<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, style) +
           report_text_escape(text) + "</text>\n";
}

const char *fill_of(int boards) {
    if (boards == 0) {
        return "#f6dede";
    }
    return boards >= CAPTURE_BOARDS_WANTED ? "#e6f3e4" : "#fbf4da";
}

/// A camera's frame at a zoom with all corners seen there.
std::string tile_of(const capture_optics &optics, const capture_coverage::camera &camera, int side,
                    double x, double y) {
    const double scale = tile / optics.width_px, height = scale * optics.height_px;
    std::string svg = report_text_format(
        "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\" "
        "stroke=\"#888\"/>\n<path stroke=\"%s\" stroke-width=\"1.6\" stroke-linecap=\"round\" "
        "d=\"",
        x, y, tile, height, fill_of(camera.boards), colours[side]);
    for (const auto &point : camera.points) {
        svg += report_text_format("M%.1f %.1fh0", x + scale * point[0], y + scale * point[1]);
    }
    return svg + "\"/>\n" +
           label(x + 3, y + height - 4, std::to_string(camera.boards), "fill=\"#555\"");
}

/// The instrument, its fields of view at the widest zoom, and the board, from above.
std::string from_above(const capture_optics &optics, const calib::board &board,
                       const capture_place &place, const std::array<double, 2> &pan_deg, double x,
                       double y, double height) {
    const double reach = 1.25 * place.z_mm, scale = height / reach;
    const double middle = x + 170, bottom = y + height;
    const double half = std::atan(0.5 * optics.width_px * optics.pixel_mm / optics.focal_wide_mm);
    std::string svg = label(x, y - 8, "From above: where the board should be next");
    for (int side = 0; side < 2; side++) {
        const double x0 = middle + (side == 0 ? -0.5 : 0.5) * optics.baseline_mm * scale;
        for (const double edge : {-half, half}) {
            const double angle = pan_deg[static_cast<size_t>(side)] * MATH_RAD_PER_DEGREE + edge;
            svg += line(x0, bottom, x0 + reach * scale * std::tan(angle), y,
                        (std::string("stroke=\"") + colours[side] + "\" opacity=\"0.5\"").c_str());
        }
        svg += report_text_format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"5\" fill=\"%s\"/>\n", x0,
                                  bottom, colours[side]);
    }
    const double width = 0.5 * (board.columns + 1) * board.square_mm;
    const double dx = width * std::cos(place.turn_deg[1] * MATH_RAD_PER_DEGREE) * scale;
    const double dz = -width * std::sin(place.turn_deg[1] * MATH_RAD_PER_DEGREE) * scale;
    const double bx = middle + place.x_mm * scale, by = bottom - place.z_mm * scale;
    return svg + line(bx - dx, by + dz, bx + dx, by - dz, "stroke=\"#111\" stroke-width=\"4\"") +
           label(middle - 90, bottom + 20,
                 report_text_format("%.0f mm from the cameras", place.z_mm));
}

/// The board as the left camera should see it at the widest zoom.
std::string through_the_camera(const capture_optics &optics, const calib::board &board,
                               const capture_place &place, const std::array<double, 2> &pan_deg,
                               double x, double y) {
    const double width = 330, scale = width / optics.width_px, height = scale * optics.height_px;
    const double pan = place.aim ? std::atan2(place.x_mm + 0.5 * optics.baseline_mm, place.z_mm)
                                 : pan_deg[0] * MATH_RAD_PER_DEGREE;
    std::string points;
    for (const double corner : {0.0, 1.0, 2.0, 3.0}) {
        const double u = corner == 0 || corner == 3 ? -0.5 : 0.5, v = corner < 2 ? -0.5 : 0.5;
        const double bx = u * (board.columns + 1) * board.square_mm;
        const double by = v * (board.rows + 1) * board.square_mm;
        const double ry = place.turn_deg[1] * MATH_RAD_PER_DEGREE,
                     rx = place.turn_deg[0] * MATH_RAD_PER_DEGREE;
        const double px = place.x_mm + 0.5 * optics.baseline_mm + bx * std::cos(ry);
        const double pz = place.z_mm - bx * std::sin(ry) + by * std::sin(rx);
        const double cx = std::cos(pan) * px - std::sin(pan) * pz;
        const double cz = std::sin(pan) * px + std::cos(pan) * pz;
        const double f = optics.focal_wide_mm / optics.pixel_mm;
        points += report_text_format(
            "%.1f,%.1f ", x + scale * (0.5 * optics.width_px + f * cx / cz),
            y + scale * (0.5 * optics.height_px + f * (place.y_mm + by * std::cos(rx)) / cz));
    }
    return label(x, y - 8, "Through the left camera, widest zoom") +
           report_text_format(
               "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" "
               "fill=\"#f4f4f4\" stroke=\"#888\"/>\n<polygon points=\"%s\" "
               "fill=\"#333\" opacity=\"0.75\"/>\n",
               x, y, width, height, points.c_str());
}

}  // namespace

std::string capture_drawing(const capture_optics &optics, const std::vector<int> &zooms,
                            const calib::board &board, const capture_coverage &covered,
                            const capture_place *next, const std::array<double, 2> &pan_deg) {
    const double row = tile * optics.height_px / optics.width_px + 26;
    const double below = top + 2 * row + 50;
    const double width = left_margin + static_cast<double>(zooms.size()) * (tile + gap) + gap;
    const double height = next != nullptr ? below + 330 : below - 20;
    std::string svg = report_text_format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
        "font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%%\" height=\"100%%\" "
        "fill=\"white\"/>\n",
        width, height);
    svg += label(gap, 20,
                 "Corners seen at each zoom; the number: boards with 12 corners or more (wanted: " +
                     std::to_string(CAPTURE_BOARDS_WANTED) + ")");
    for (size_t i = 0; i < zooms.size(); i++) {
        const double x = left_margin + static_cast<double>(i) * (tile + gap);
        svg += label(x, top - 6, report_text_format("%.1f mm", optics.focal_mm(zooms[i])));
        for (int side = 0; side < 2; side++) {
            svg += tile_of(optics, covered.zoom[i][static_cast<size_t>(side)], side, x,
                           top + side * row);
        }
    }
    svg += label(gap, top + 20, "left") + label(gap, top + row + 20, "right");
    if (next != nullptr) {
        svg +=
            label(gap, below - 12, "Next: " + capture_place_text(*next), "font-weight=\"bold\"") +
            from_above(optics, board, *next, pan_deg, left_margin, below + 26, 240) +
            through_the_camera(optics, board, *next, pan_deg, left_margin + 480, below + 26);
    }
    return svg + "</svg>\n";
}

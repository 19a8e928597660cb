// SPDX-License-Identifier: Apache-2.0
// What depth can be expected from the rig, and a drawing of it.
#include <algorithm>
#include <cmath>

#include "calib/zoom/zoom_expected.hpp"
#include "core/math.h"
#include "stereo/zoom/zoom_sigma.h"
#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/calibration_report/zoom_report.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

const double matched_px = calib::EXPECTED_MATCH_PX;
const double depths_mm[] = {1000, 1800, 3000, 10000, 100000};

std::string length_text(double mm) {
    return report_text_length(mm, "mm");
}

std::string sigma_text(double sigma_mm) {
    return sigma_mm > 0 ? "± " + length_text(sigma_mm) : "–";
}

std::string depth_row(const zoom_page &page, double share, double depth_mm) {
    const zoom_calibration &rig = *page.result->rig;
    const zoom_state state = calib::zoom_aimed(rig, share, depth_mm);
    const zoom_state second = calib::zoom_again(rig, state, share < 0.5 ? 1 : 0);
    const calib::zoom_expected expected =
        calib::expect_zoom(rig, state, second, page.seen->boards[0], depth_mm);
    zoom_pair pair;
    zoom_pair_at(rig.camera, &state, &pair);
    const double middle[2] = {0.5 * (rig.camera[0].width_px - 1),
                              0.5 * (rig.camera[0].height_px - 1)};
    const zoom_variance variance = zoom_depth_variance(&rig, &state, middle, depth_mm);
    if (!(variance.lens > 0) || !(expected.read.depth_mm > 0)) {
        return "<tr><th scope=\"row\">" + length_text(depth_mm) +
               "</th><td colspan=\"8\">not seen by both</td></tr>\n";
    }
    const double baseline_mm = std::fabs(rig.camera[1].mount[ZOOM_POSITION_X]);
    const double match_mm =
        matched_px * depth_mm * depth_mm / (pair.side[0].lens.fx_px * baseline_mm);
    const double lens = std::sqrt(std::max(0.0, variance.lens + variance.mount + variance.cross));
    return page_row(length_text(depth_mm),
                    {sigma_text(expected.read.depth_mm), sigma_text(expected.own.depth_mm),
                     sigma_text(expected.second.depth_mm), sigma_text(expected.board.depth_mm),
                     length_text(lens), length_text(std::sqrt(variance.motor)),
                     length_text(std::sqrt(variance.pan)), length_text(match_mm)});
}

// From above: x to the right, z up the page.
struct drawing {
    std::string marks;
    double scale, left, bottom;

    double at_x(double mm) const { return left + scale * mm; }
    double at_y(double mm) const { return bottom - scale * mm; }

    void line(double x1, double z1, double x2, double z2, const char *kind) {
        marks += report_text_format("<path class=\"line %s\" d=\"M%.1f %.1fL%.1f %.1f\"/>\n", kind,
                                    at_x(x1), at_y(z1), at_x(x2), at_y(z2));
    }
    void dot(double x, double z, const char *kind) {
        marks += report_text_format("<path class=\"dots big %s\" d=\"M%.1f %.1fh0\"/>\n", kind,
                                    at_x(x), at_y(z));
    }
};

}  // namespace

std::string zoom_report_depth(const zoom_page &page) {
    const zoom_calibration &rig = *page.result->rig;
    std::string html;
    for (const double share : {0.0, 0.5, 1.0}) {
        const zoom_state state = zoom_report_state(page, share);
        const double f = zoom_function_value(&rig.camera[0], ZOOM_FOCAL, state.side[0].zoom_counts);
        std::string rows;
        for (const double depth_mm : depths_mm) {
            rows += depth_row(page, share, depth_mm);
        }
        html += page_table(report_text_format("f = %.0f px", f),
                           {"depth", "motors as read", "own matches", "a second zoom",
                            "board in view", "lenses, rig", "motors", "pan", "matching"},
                           rows);
    }
    return html +
           report_text_format(
               "<p>One standard deviation, in the middle of the image, both cameras turned to the "
               "point as far as they were calibrated. Motors as read: what the lenses, the rig, "
               "the "
               "motors and the pans (columns on the right) leave together. Own matches: every pair "
               "is refined by what its two images show, here %d matches to %.1f px with a relief "
               "of "
               "1/%.0f of the distance; with a second zoom, the pans untouched; or with the board "
               "in "
               "view (–: too few of its corners would be). Matching: %.1f px of disparity, of each "
               "point by "
               "itself; all else is common to the points of a pair.</p>\n",
               calib::EXPECTED_MATCHES, calib::EXPECTED_MATCH_PX, 1 / calib::EXPECTED_RELIEF,
               matched_px);
}

std::string zoom_report_rig(const zoom_page &page) {
    const zoom_calibration &rig = *page.result->rig;
    const double reach_mm = 1800, cost_rad = 0.1 * MATH_RAD_PER_DEGREE;
    const zoom_state state = calib::zoom_aimed(rig, 0, reach_mm);
    zoom_pair pair;
    zoom_pair_at(rig.camera, &state, &pair);
    const double baseline_mm = std::fabs(rig.camera[1].mount[ZOOM_POSITION_X]);
    drawing sketch{"", 0.14, 150, 300};
    for (int side = 0; side < 2; side++) {
        const char *kind = side == 0 ? "mark-a" : "mark-b";
        const double *at = pair.side[side].position_mm, *R = pair.side[side].R_instrument_camera;
        const double *mount = rig.camera[side].mount;
        sketch.line(at[0], at[2], at[0] + reach_mm * R[2], at[2] + reach_mm * R[8], kind);
        sketch.dot(at[0], at[2], kind);
        sketch.line(mount[ZOOM_AXIS_POINT_X] - 25, mount[ZOOM_AXIS_POINT_Z],
                    mount[ZOOM_AXIS_POINT_X] + 25, mount[ZOOM_AXIS_POINT_Z], "mark-soft");
    }
    std::string rows;
    for (const double depth_mm : depths_mm) {
        rows += page_row(length_text(depth_mm),
                         length_text(depth_mm * depth_mm / baseline_mm * cost_rad));
    }
    const std::string svg =
        "<svg class=\"plot\" viewBox=\"0 0 360 330\" role=\"img\" "
        "aria-label=\"The rig from above\">\n" +
        sketch.marks + "</svg>\n";
    return "<div class=\"grid two\">\n" +
           page_figure(
               svg, report_text_format(
                        "<b>From above.</b> Baseline %.2f mm. Dots: entrance pupils at the "
                        "smallest focal length. Bars: pan axes. Lines: optical axes up to %.1f m.",
                        baseline_mm, reach_mm / 1000)) +
           page_table("What 0.1 degrees of one pan cost", {"depth", "error"}, rows) + "</div>\n";
}

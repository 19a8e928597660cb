// SPDX-License-Identifier: Apache-2.0
// Functions of the lenses: curves, error bars, each zoom alone, and straight lines.
#include <algorithm>
#include <cmath>

#include "stereo/zoom/zoom_sigma.h"
#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/calibration_report/zoom_report.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

const int steps = 80;
const char *const mark[] = {"mark-a", "mark-b"};
const char *const soft_mark[] = {"mark-a faint", "mark-b faint"};
const char *const dashed_mark[] = {"mark-a dashed", "mark-b dashed"};
const char *const side_name[] = {"left", "right"};

// One zoom of a camera, calibrated alone: f focused at infinity.
struct single {
    double zoom, focal_px, sigma_px;
};

std::vector<single> singles_of(const zoom_page &page, size_t side) {
    std::vector<single> list;
    const calib::zoom_side &zoom_side = page.result->problem.side[side];
    for (const calib::zoom_setting &one : page.result->settings) {
        const calib::solution &alone = one.alone[side];
        if (alone.solved) {
            list.push_back({zoom_side.settings[size_t(one.setting[side])],
                            calib::focal_at_infinity(alone.camera[0].fx_px, zoom_side.pixel_mm,
                                                     one.focused_mm[side]),
                            alone.sigma.focal_px[0]});
        }
    }
    return list;
}

void focal_values(const zoom_pair *pair, void *, double *values) {
    values[0] = pair->side[0].f_px;
    values[1] = pair->side[1].f_px;
}

double curve_of(const zoom_calibration &rig, size_t side, double zoom) {
    return zoom_function_value(&rig.camera[side], ZOOM_FOCAL, zoom);
}

calibration_report_axis zoom_axis(const zoom_page &page) {
    const zoom_camera *camera = page.result->rig->camera;
    return {std::min(camera[0].zoom.min, camera[1].zoom.min),
            std::max(camera[0].zoom.max, camera[1].zoom.max), false, "zoom position, counts"};
}

std::string focal_figure(const zoom_page &page) {
    const zoom_calibration &rig = *page.result->rig;
    const zoom_camera *camera = rig.camera;
    calibration_report_axis y{
        0.9 * std::exp(std::min(camera[0].log_focal.min, camera[1].log_focal.min)),
        1.1 * std::exp(std::max(camera[0].log_focal.max, camera[1].log_focal.max)), true,
        "focal length, px"};
    calibration_report_plot plot(zoom_axis(page), y, 330);
    for (size_t side = 0; side < 2; side++) {
        calibration_report_points curve, straight, dots;
        for (int i = 0; i <= steps; i++) {
            const zoom_range &range = camera[side].zoom;
            const double zoom = range.min + (range.max - range.min) * i / steps;
            curve.push_back({zoom, curve_of(rig, side, zoom)});
            straight.push_back({zoom, curve_of(*page.result->paper, side, zoom)});
        }
        for (const single &one : singles_of(page, side)) {
            dots.push_back({one.zoom, one.focal_px});
            plot.line({{one.zoom, one.focal_px - 3 * one.sigma_px},
                       {one.zoom, one.focal_px + 3 * one.sigma_px}},
                      mark[side]);
        }
        plot.line(straight, dashed_mark[side]);
        plot.line(curve, mark[side]);
        plot.dots(dots, side == 0 ? "mark-a big" : "mark-b big");
        plot.legend(mark[side], side_name[side]);
    }
    plot.legend("mark-ink dashed", "straight line");
    return page_figure(
        plot.svg("Focal length against zoom position"),
        "<b>Focal length against zoom position.</b> Focused at infinity. Dots: each zoom "
        "calibrated alone, with three sigmas. Lines: the joint solution. Dashed: straight lines "
        "through the dots.");
}

// Relative to the curve, in percent.
std::string focal_difference_figure(const zoom_page &page, size_t side) {
    const zoom_calibration &rig = *page.result->rig;
    const zoom_camera &camera = rig.camera[side];
    calibration_report_points above, below, count_above, count_below, straight;
    double high = 0.01;
    for (int i = 0; i <= steps; i++) {
        const zoom_state state = zoom_report_state(page, double(i) / steps);
        zoom_variance variance[2];
        zoom_propagate(&rig, &state, focal_values, nullptr, 2, variance);
        const double zoom = state.side[side].zoom_counts, f = curve_of(rig, side, zoom);
        const double smooth = variance[side].lens + variance[side].mount;
        const double sigma = 100 * std::sqrt(std::max(0.0, smooth)) / f;
        const double count = 100 * std::fabs(curve_of(rig, side, zoom + 1) / f - 1);
        above.push_back({zoom, 2 * sigma});
        below.push_back({zoom, -2 * sigma});
        count_above.push_back({zoom, count});
        count_below.push_back({zoom, -count});
        straight.push_back({zoom, 100 * (curve_of(*page.result->paper, side, zoom) / f - 1)});
        high = std::max({high, 3 * sigma, 1.3 * count});
    }
    calibration_report_points dots;
    std::vector<calibration_report_points> bars;
    for (const single &one : singles_of(page, side)) {
        const double f = curve_of(rig, side, one.zoom), off = 100 * (one.focal_px / f - 1);
        const double sigma = 100 * one.sigma_px / f;
        dots.push_back({one.zoom, off});
        bars.push_back({{one.zoom, off - sigma}, {one.zoom, off + sigma}});
    }
    const double edge = calibration_report_round_up(high);
    calibration_report_plot plot({camera.zoom.min, camera.zoom.max, false, "zoom position, counts"},
                                 {-edge, edge, false, "difference, %"});
    plot.line(count_above, "mark-soft dashed");
    plot.line(count_below, "mark-soft dashed");
    plot.line(straight, dashed_mark[side]);
    plot.line(above, soft_mark[side]);
    plot.line(below, soft_mark[side]);
    for (const calibration_report_points &bar : bars) {
        plot.line(bar, mark[side]);
    }
    plot.dots(dots, side == 0 ? "mark-a big" : "mark-b big");
    plot.legend("mark-soft dashed", "one count");
    plot.legend(soft_mark[side], "two sigmas");
    plot.legend(dashed_mark[side], "straight line");
    return page_figure(
        plot.svg(std::string("Difference from the curve, ") + side_name[side]),
        std::string("<b>Difference from the curve, ") + side_name[side] +
            ".</b> Dots: each zoom calibrated alone, with one sigma. What one count of the zoom's "
            "read position changes is dashed.");
}

// Values that `function_values` computes for each side.
enum { VALUE_CENTRE_X, VALUE_CENTRE_Y, VALUE_RADIAL_2, VALUE_RADIAL_4, VALUES };

void function_values(const zoom_pair *pair, void *, double *values) {
    for (int side = 0; side < 2; side++) {
        const lens &lens = pair->side[side].lens;
        const double radius = 0.5 * std::hypot(double(lens.width_px), double(lens.height_px));
        const double share = radius / lens.fx_px;
        double *out = values + side * VALUES;
        out[VALUE_CENTRE_X] = lens.cx_px - 0.5 * (lens.width_px - 1);
        out[VALUE_CENTRE_Y] = lens.cy_px - 0.5 * (lens.height_px - 1);
        out[VALUE_RADIAL_2] = lens.k1 * share * share * radius;
        out[VALUE_RADIAL_4] = lens.k2 * share * share * share * share * radius;
    }
}

struct value_curve {
    calibration_report_points middle, above, below;
};

std::string value_figure(const std::vector<value_curve> &curves, int value, const char *name,
                         const char *unit, const calibration_report_axis &x) {
    double low = INFINITY, high = -INFINITY;
    for (int side = 0; side < 2; side++) {
        const value_curve &curve = curves[size_t(side * VALUES + value)];
        for (size_t i = 0; i < curve.middle.size(); i++) {
            low = std::min(low, curve.below[i].second);
            high = std::max(high, curve.above[i].second);
        }
    }
    const double edge = 0.05 * (high - low) + 1e-3;
    calibration_report_plot plot(x, {low - edge, high + edge, false, unit});
    for (int side = 0; side < 2; side++) {
        const value_curve &curve = curves[size_t(side * VALUES + value)];
        plot.line(curve.above, soft_mark[side]);
        plot.line(curve.below, soft_mark[side]);
        plot.line(curve.middle, mark[side]);
        plot.legend(mark[side], side_name[side]);
    }
    return page_figure(plot.svg(name), std::string("<b>") + name + ".</b> Thin: two sigmas.");
}

std::string pupil_figure(const zoom_page &page, const calibration_report_axis &x) {
    const zoom_calibration &rig = *page.result->rig;
    calibration_report_points points[2];
    double low = 0, high = 1;
    for (size_t side = 0; side < 2; side++) {
        const zoom_range &range = rig.camera[side].log_focal;
        for (int i = 0; i <= steps; i++) {
            const double log_f = range.min + (range.max - range.min) * i / steps;
            const double mm = zoom_function_value(&rig.camera[side], ZOOM_PUPIL, log_f);
            points[side].push_back({std::exp(log_f), mm});
            low = std::min(low, mm);
            high = std::max(high, mm);
        }
    }
    calibration_report_plot plot(x, {low - 0.5, high + 0.5, false, "mm forward"});
    for (size_t side = 0; side < 2; side++) {
        plot.line(points[side], mark[side]);
        plot.legend(mark[side], side_name[side]);
    }
    return page_figure(plot.svg("Entrance pupil"),
                       "<b>Entrance pupil.</b> Its shift along the axis.");
}

}  // namespace

std::string zoom_report_focal(const zoom_page &page) {
    return "<div class=\"grid two\">\n" + focal_figure(page) + focal_difference_figure(page, 0) +
           focal_difference_figure(page, 1) + "</div>\n";
}

std::string zoom_report_functions(const zoom_page &page) {
    const zoom_calibration &rig = *page.result->rig;
    std::vector<value_curve> curves(2 * VALUES);
    for (int i = 0; i <= steps; i++) {
        const zoom_state state = zoom_report_state(page, double(i) / steps);
        zoom_pair pair;
        zoom_pair_at(rig.camera, &state, &pair);
        double values[2 * VALUES];
        zoom_variance variance[2 * VALUES];
        function_values(&pair, nullptr, values);
        zoom_propagate(&rig, &state, function_values, nullptr, 2 * VALUES, variance);
        for (size_t k = 0; k < 2 * VALUES; k++) {
            const double f = pair.side[k / VALUES].f_px;
            const double sigma = std::sqrt(std::max(0.0, variance[k].lens));
            curves[k].middle.push_back({f, values[k]});
            curves[k].above.push_back({f, values[k] + 2 * sigma});
            curves[k].below.push_back({f, values[k] - 2 * sigma});
        }
    }
    const calibration_report_axis x{
        std::exp(std::min(rig.camera[0].log_focal.min, rig.camera[1].log_focal.min)),
        std::exp(std::max(rig.camera[0].log_focal.max, rig.camera[1].log_focal.max)), true,
        "focal length, px"};
    return "<div class=\"grid two\">\n" +
           value_figure(curves, VALUE_CENTRE_X, "Image centre, x", "px from the middle", x) +
           value_figure(curves, VALUE_CENTRE_Y, "Image centre, y", "px from the middle", x) +
           value_figure(curves, VALUE_RADIAL_2, "Distortion k1", "px at the corner", x) +
           value_figure(curves, VALUE_RADIAL_4, "Distortion k2", "px at the corner", x) +
           pupil_figure(page, x) + "</div>\n";
}

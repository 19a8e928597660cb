// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "core/invariant.h"
#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

// Of the plot, in its own units; the page scales it.
const double WIDTH = 460, LEFT = 52, RIGHT = 12, TOP = 24, BOTTOM = 40;

double share_of(const calibration_report_axis &axis, double value) {
    if (axis.log) {
        return std::log(value / axis.low) / std::log(axis.high / axis.low);
    }
    return (value - axis.low) / (axis.high - axis.low);
}

std::string tick_text(double value) {
    if (std::fabs(value) >= 10000) {
        return report_text_format("%.0fk", value / 1000);
    }
    return report_text_format("%.4g", std::fabs(value) < 1e-12 ? 0.0 : value);
}

}  // namespace

std::vector<double> calibration_report_ticks(const calibration_report_axis &axis, int count) {
    INVARIANT(axis.high > axis.low && count > 0);
    std::vector<double> ticks;
    if (axis.log) {
        INVARIANT(axis.low > 0);
        for (double power = std::pow(10, std::floor(std::log10(axis.low))); power <= axis.high;
             power *= 10) {
            for (const double digit : {1.0, 2.0, 5.0}) {
                const double value = digit * power;
                if (value >= axis.low * (1 - 1e-9) && value <= axis.high * (1 + 1e-9)) {
                    ticks.push_back(value);
                }
            }
        }
        return ticks;
    }
    const double step = calibration_report_round_up((axis.high - axis.low) / count);
    for (double i = std::ceil(axis.low / step - 1e-9); i * step <= axis.high + 1e-9 * step; i++) {
        ticks.push_back(i * step);
    }
    return ticks;
}

double calibration_report_round_up(double value) {
    INVARIANT(value > 0);
    const double power = std::pow(10, std::floor(std::log10(value)));
    for (const double digit : {1.0, 2.0, 5.0}) {
        if (digit * power >= value * (1 - 1e-9)) {
            return digit * power;
        }
    }
    return 10 * power;
}

calibration_report_plot::calibration_report_plot(const calibration_report_axis &x,
                                                 const calibration_report_axis &y, double height)
    : x_(x), y_(y), height_(height), legend_x_(LEFT) {
    INVARIANT(x.high > x.low && y.high > y.low && height > TOP + BOTTOM);
}

double calibration_report_plot::at_x(double value) const {
    return LEFT + (WIDTH - LEFT - RIGHT) * share_of(x_, value);
}

double calibration_report_plot::at_y(double value) const {
    return height_ - BOTTOM - (height_ - TOP - BOTTOM) * share_of(y_, value);
}

void calibration_report_plot::line(const calibration_report_points &points, const char *kind) {
    std::string path;
    bool pen_down = false;
    for (const auto &point : points) {
        const double x = at_x(point.first), y = at_y(point.second);
        const bool drawn = std::isfinite(x) && std::isfinite(y);
        if (drawn) {
            path += report_text_format("%s%.1f %.1f", pen_down ? "L" : "M", x,
                                       std::clamp(y, -1e4, 1e4));
        }
        pen_down = drawn;
    }
    body_ += report_text_format("<path class=\"line %s\" d=\"%s\"/>\n", kind, path.c_str());
}

void calibration_report_plot::dots(const calibration_report_points &points, const char *kind) {
    std::string path;
    for (const auto &point : points) {
        const double x = at_x(point.first), y = at_y(point.second);
        if (std::isfinite(x) && std::isfinite(y) && std::fabs(x) < 1e4 && std::fabs(y) < 1e4) {
            path += report_text_format("M%.1f %.1fh0", x, y);
        }
    }
    body_ += report_text_format("<path class=\"dots %s\" d=\"%s\"/>\n", kind, path.c_str());
}

void calibration_report_plot::bar(double x_low, double x_high, double y, const char *kind,
                                  const std::string &title) {
    const double left = at_x(x_low), top = at_y(y);
    body_ += report_text_format(
        "<rect class=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"><title>%s</title>"
        "</rect>\n",
        kind, left, top, std::max(0.5, at_x(x_high) - left - 1), std::max(0.0, at_y(y_.low) - top),
        report_text_escape(title).c_str());
}

void calibration_report_plot::text(double x, double y, const std::string &words,
                                   const char *anchor) {
    body_ += report_text_format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%s</text>\n",
                                at_x(x), at_y(y), anchor, report_text_escape(words).c_str());
}

void calibration_report_plot::circle(double x, double y, double radius, const char *kind) {
    body_ += report_text_format(
        "<ellipse class=\"line %s\" cx=\"%.1f\" cy=\"%.1f\" rx=\"%.1f\" ry=\"%.1f\"/>\n", kind,
        at_x(x), at_y(y), at_x(x + radius) - at_x(x), at_y(y) - at_y(y + radius));
}

void calibration_report_plot::legend(const char *kind, const std::string &name) {
    legend_ += report_text_format(
        "<path class=\"line %s\" d=\"M%.0f 10h16\"/><text x=\"%.0f\" y=\"14\">%s</text>\n", kind,
        legend_x_, legend_x_ + 21, report_text_escape(name).c_str());
    legend_x_ += 36 + 6.6 * static_cast<double>(name.size());
}

std::string calibration_report_plot::svg(const std::string &name) const {
    std::string grid;
    const double right = WIDTH - RIGHT, bottom = height_ - BOTTOM;
    for (const double value : x_.ticks ? calibration_report_ticks(x_, 6) : std::vector<double>()) {
        const double x = at_x(value);
        grid += report_text_format(
            "<path class=\"grid-line\" d=\"M%.1f %.1fV%.1f\"/><text x=\"%.1f\" y=\"%.1f\" "
            "text-anchor=\"middle\">%s</text>\n",
            x, TOP, bottom, x, bottom + 16, tick_text(value).c_str());
    }
    for (const double value : y_.ticks ? calibration_report_ticks(y_, 5) : std::vector<double>()) {
        const double y = at_y(value);
        grid += report_text_format(
            "<path class=\"grid-line\" d=\"M%.1f %.1fH%.1f\"/><text x=\"%.1f\" y=\"%.1f\" "
            "text-anchor=\"end\">%s</text>\n",
            LEFT, y, right, LEFT - 6, y + 4, tick_text(value).c_str());
    }
    grid += report_text_format(
        "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>\n"
        "<text transform=\"translate(13 %.1f) rotate(-90)\" text-anchor=\"middle\">%s</text>\n",
        0.5 * (LEFT + right), height_ - 6, report_text_escape(x_.label).c_str(),
        0.5 * (TOP + bottom), report_text_escape(y_.label).c_str());
    // The marks in a nested SVG, which clips them.
    return report_text_format(
               "<svg class=\"plot\" viewBox=\"0 0 %.0f %.0f\" role=\"img\" aria-label=\"%s\">\n",
               WIDTH, height_, report_text_escape(name).c_str()) +
           grid +
           report_text_format(
               "<svg x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" "
               "viewBox=\"%.1f %.1f %.1f %.1f\">\n",
               LEFT, TOP - 4, right - LEFT, bottom - TOP + 5, LEFT, TOP - 4, right - LEFT,
               bottom - TOP + 5) +
           body_ + "</svg>\n" + legend_ + "</svg>\n";
}

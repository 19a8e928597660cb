// SPDX-License-Identifier: Apache-2.0
/// Plots of the page: axes, lines, dots and bars as SVG in the page's colours.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_PLOT_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_PLOT_HPP

#include <string>
#include <utility>
#include <vector>

using calibration_report_points = std::vector<std::pair<double, double>>;

/// Values along one side of a plot.
struct calibration_report_axis {
    double low = 0, high = 1;
    bool log = false;
    std::string label;  // with unit
    bool ticks = true;
};

/// About `count` round values within [low, high]; on a logarithmic axis 1, 2, 5 times powers of
/// ten.
std::vector<double> calibration_report_ticks(const calibration_report_axis &axis, int count);

/// The smallest of 1, 2, 5 times a power of ten that is >= value; value > 0.
double calibration_report_round_up(double value);

/// A plot with axes. Marks outside of it are clipped; NaN marks are omitted.
class calibration_report_plot {
  public:
    calibration_report_plot(const calibration_report_axis &x, const calibration_report_axis &y,
                            double height = 280);

    /// `kind` is a class of the style sheet: "mark-a", "mark-b" (left, right), "mark-soft", ...
    void line(const calibration_report_points &points, const char *kind);
    void dots(const calibration_report_points &points, const char *kind);
    /// A bar from y = 0 up to `y` between two x.
    void bar(double x_low, double x_high, double y, const char *kind, const std::string &title);
    void text(double x, double y, const std::string &words, const char *anchor = "start");
    void circle(double x, double y, double radius, const char *kind);
    /// "name" next to a dash of that kind, above the plot.
    void legend(const char *kind, const std::string &name);

    /// The finished <svg>; `name` is its text for screen readers.
    std::string svg(const std::string &name) const;

  private:
    double at_x(double value) const;
    double at_y(double value) const;

    calibration_report_axis x_, y_;
    double height_;
    std::string body_, legend_;
    double legend_x_;
};

/// A figure with a caption (HTML).
std::string calibration_report_figure(const std::string &content, const std::string &caption);

#endif

// SPDX-License-Identifier: Apache-2.0
/// The sections of the page, as HTML. All but `rejected` need a solved solution and its figures.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_SECTIONS_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_SECTIONS_HPP

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tools/host/calibration_report/calibration_page.hpp"
#include "tools/host/calibration_report/calibration_report_figures.hpp"
#include "tools/host/convert/export.hpp"

/// The document of calibration.html; `title` is plain text.
std::string calibration_report_document(const std::string &title, const std::string &meta,
                                        const std::string &body);

std::string calibration_report_verdict(const calib::solution &result);
/// The sentence of a verdict, "Good: ..." or "Not good: ...", and its reasons: the first is part of
/// the sentence. `kind`: is-good, is-fair, is-bad.
std::string calibration_report_verdict_box(const std::string &kind, const std::string &sentence,
                                           const std::vector<std::string> &reasons,
                                           const std::vector<std::string> &remarks);
std::string calibration_report_cards(const calibration_page &page,
                                     const calibration_figures &figures);
std::string calibration_report_hints(const calibration_figures &figures);
std::string calibration_report_coverage(const calibration_page &page,
                                        const calibration_figures &figures);
std::string calibration_report_residuals(const calibration_page &page,
                                         const calibration_figures &figures);
std::string calibration_report_views(const calibration_page &page);
std::string calibration_report_rejected(const calibration_page &page);
std::string calibration_report_uncertainty(const calibration_page &page,
                                           const calibration_figures &figures);
std::string calibration_report_pair(const calibration_page &page,
                                    const calibration_figures &figures);
std::string calibration_report_tables(const calibration_page &page,
                                      const calibration_figures &figures);

/// "left", "right"; "camera" if there is only one.
const char *calibration_report_side(const calibration_page &page, int camera);

/// File name of an image, HTML-escaped; its number where it has no name.
std::string calibration_report_image_name(const calibration_page &page, std::size_t capture,
                                          int camera);

/// Grey pictures of the page: loading, shrinking, rectifying, encoding.

struct calibration_picture {
    std::vector<std::uint8_t> grey;  // rows without gaps
    int width_px = 0, height_px = 0;
};

/// Calls the page's loader. Returns false when the picture is unavailable.
bool calibration_picture_load(const calibration_page &page, std::size_t capture, int camera,
                              calibration_picture *picture);

/// At most `width_px` wide, by the mean of the pixels that a new one covers.
calibration_picture calibration_picture_shrink(const calibration_picture &picture, int width_px);

/// What the rectified camera of `side` (0 left, 1 right) sees, `scale` times the size of the left
/// raw image (scale <= 1); black outside the raw image.
calibration_picture calibration_picture_rectify(const calibration_picture &raw,
                                                const calibration &rig,
                                                const export_rectified &rectified, int side,
                                                double scale);

/// A data: URI; "" on failure.
std::string calibration_picture_jpeg(const calibration_picture &picture);

/// Plots of the page: axes, lines, dots and bars as SVG in the page's colours.

using calibration_report_points = std::vector<std::pair<double, double>>;

/// Values along one side of a plot.
struct calibration_report_axis {
    double low = 0, high = 1;
    bool log = false;
    std::string label;  // text with the unit
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

#endif

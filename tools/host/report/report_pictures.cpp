// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"
#include "tools/host/report/report_sections.hpp"

namespace {

/// The frame to which scripts attach their marks. `content` is drawn above the picture.
std::string frame(const char *classes, const char *side, const std::string &uri, const char *id,
                  const std::string &label, const std::string &content) {
    return report_text_format(
        "<div class=\"frame %s\" data-side=\"%s\" tabindex=\"0\"><img %s src=\"%s\" alt=\"%s\">%s"
        "</div>",
        classes, side, id, uri.c_str(), report_text_escape(label).c_str(), content.c_str());
}

/// Evenly spaced rows as SVG lines, the same in both images.
std::string row_lines() {
    std::string svg =
        "<svg class=\"rows\" viewBox=\"0 0 100 100\" preserveAspectRatio=\"none\" "
        "aria-hidden=\"true\">";
    for (int i = 1; i < 10; i++) {
        svg +=
            report_text_format("<line x1=\"0\" x2=\"100\" y1=\"%d\" y2=\"%d\"/>", 10 * i, 10 * i);
    }
    return svg + "</svg>";
}

page_ticks even_ticks(double low, double high, const char *unit) {
    page_ticks ticks;
    for (int i = 0; i <= 4; i++) {
        char text[48];
        const double value = low + (high - low) * i / 4;
        std::snprintf(text, sizeof text, "%.*f%s", std::fabs(high - low) < 8 ? 2 : 0, value,
                      i == 4 ? unit : "");
        ticks.push_back({i / 4.0, text});
    }
    return ticks;
}

/// The 1 % and 99 % quantiles of the valid disparities, in px.
void disparity_range(const reconstruct_result &result, double *low_px, double *high_px) {
    std::vector<std::int32_t> values;
    for (int y = 0; y < result.left.height; y++) {
        for (int x = 0; x < result.left.width; x++) {
            if (reason_has_disparity(image_u8_row(&result.match.reason, y)[x])) {
                values.push_back(image_i32_row(&result.match.disparity_q8, y)[x]);
            }
        }
    }
    *low_px = result.plan.disparity_min;
    *high_px = result.plan.disparity_min + result.plan.disparity_count;
    if (values.empty()) {
        return;
    }
    std::sort(values.begin(), values.end());
    *low_px = std::floor(values[values.size() / 100] / 256.0);
    *high_px =
        std::max(*low_px + 1, std::ceil(values[values.size() - 1 - values.size() / 100] / 256.0));
}

std::string disparity_figure(const reconstruct_context &context, const report_figures &figures,
                             const report_grid &grid) {
    const reconstruct_result &result = *context.result;
    double low_px = 0, high_px = 0;
    disparity_range(result, &low_px, &high_px);
    const colormap_table table = colormap_sequential();
    const std::string uri =
        report_encode_png(grid.width_px, grid.height_px,
                          report_layers_disparity(result, grid, low_px, high_px), table);
    std::string caption = "<b>Disparity</b>, x left − x right; bright is near.";
    page_ticks ticks;
    const rectify_plan &plan = result.plan;
    for (int i = 0; i <= 4; i++) {
        const double d = low_px + (high_px - low_px) * i / 4;
        const double shift = d - (plan.cx_left_px - plan.cx_right_px);
        std::string text = report_text_format("%.*f px", high_px - low_px < 8 ? 2 : 0, d);
        if (shift > 0) {
            text += "<br>" + report_text_length(plan.f_px * plan.baseline_mm / shift, figures.unit);
        }
        ticks.push_back({i / 4.0, text});
    }
    return page_figure(frame("map", "left", uri, "", "Map of disparities", ""),
                       caption + page_scale(page_gradient(table), ticks));
}

std::string reason_figure(const reconstruct_context &context, const report_figures &figures,
                          const report_grid &grid) {
    colormap_table table{};
    std::copy(std::begin(colormap_reasons), std::end(colormap_reasons), table.begin());
    const std::string uri = report_encode_png(grid.width_px, grid.height_px,
                                              report_layers_reason(*context.result, grid), table);
    std::vector<page_key> keys;
    for (int i = 0; i < REASON_COUNT; i++) {
        const std::uint32_t count = context.result->reason_count[i];
        keys.push_back(
            {colormap_reasons[i], reason_text(i),
             report_text_format("%.1f %%", figures.pixels > 0
                                               ? 100.0 * count / static_cast<double>(figures.pixels)
                                               : 0.0)});
    }
    return page_figure(frame("map", "left", uri, "", "Map of reasons", ""),
                       "<b>Why a pixel has no value</b>" + page_keys(keys));
}

std::string confidence_figure(const reconstruct_context &context, const report_grid &grid) {
    const colormap_table table = colormap_sequential();
    const std::string uri = report_encode_png(
        grid.width_px, grid.height_px, report_layers_confidence(*context.result, grid), table);
    return page_figure(frame("map", "left", uri, "", "Map of confidence", ""),
                       "<b>Confidence</b>: the winner's margin over its rivals." +
                           page_scale(page_gradient(table), even_ticks(0, 100, " %")));
}

std::string sigma_figure(const reconstruct_context &context, const report_grid &grid) {
    const reconstruct_result &result = *context.result;
    std::vector<std::uint16_t> values;
    for (int y = 0; y < result.left.height; y++) {
        for (int x = 0; x < result.left.width; x++) {
            if (image_u8_row(&result.sigma, y)[x] > 0) {
                values.push_back(subpixel_sigma_q8(image_u8_row(&result.sigma, y)[x]));
            }
        }
    }
    if (values.empty()) {
        return "";
    }
    std::sort(values.begin(), values.end());
    const double high_px = std::max(0.05, values[values.size() - 1 - values.size() / 50] / 256.0);
    const colormap_table table = colormap_sequential();
    const std::string uri = report_encode_png(grid.width_px, grid.height_px,
                                              report_layers_sigma(result, grid, high_px), table);
    return page_figure(frame("map", "left", uri, "", "Map of predicted sigma", ""),
                       "<b>Predicted sigma</b> of the disparity." +
                           page_scale(page_gradient(table), even_ticks(0, high_px, " px")));
}

/// A raw image as 8-bit colour.
std::vector<std::uint8_t> raw_to_rgb(const raw_image &raw, int step, int width, int height) {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const int channels = raw.layout == RAW_RGB ? 3 : 1;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const std::uint16_t *pixel =
                raw.data + static_cast<std::ptrdiff_t>(y) * step * raw.stride + x * step * channels;
            for (int c = 0; c < 3; c++) {
                rgb.push_back(
                    static_cast<std::uint8_t>(pixel[channels == 3 ? c : 0] >> (raw.bits - 8)));
            }
        }
    }
    return rgb;
}

std::string raw_figure(const raw_image &raw, const char *path, const char *side) {
    int step = 1;
    while (raw.width_px / step > 900) {
        step++;
    }
    const int width = (raw.width_px + step - 1) / step, height = (raw.height_px + step - 1) / step;
    std::vector<std::uint8_t> rgb = raw_to_rgb(raw, step, width, height);
    const image_rgb8 view = {rgb.data(), width, height, 3 * static_cast<std::ptrdiff_t>(width)};
    const std::string name = report_text_escape(report_text_file_name(path));
    return page_figure(
        report_text_format(
            "<div class=\"frame\"><img src=\"%s\" alt=\"%s image as recorded\"></div>",
            report_encode_jpeg(view, 82).c_str(), side),
        report_text_format("<b>%s</b>, as recorded: %s, %d × %d, %d bit", side, name.c_str(),
                           raw.width_px, raw.height_px, raw.bits));
}

}  // namespace

std::string report_pictures_pair(const reconstruct_context &context, const report_grid &grid) {
    const reconstruct_result &result = *context.result;
    const std::string left = report_layers_photo(result.left_colour, grid.step);
    const std::string left_figure = page_figure(
        frame("photo", "left", left, "id=\"photo\"", "Left image, rectified", row_lines()),
        "<b>Left</b> " + report_text_escape(report_text_file_name(context.left_path)));
    if (result.right_colour.data == nullptr) {
        return left_figure;
    }
    const std::string right = report_layers_photo(result.right_colour, grid.step);
    return left_figure +
           page_figure(
               frame("photo", "right", right, "", "Right image, rectified", row_lines()),
               "<b>Right</b> " + report_text_escape(report_text_file_name(context.right_path)));
}

std::string report_pictures_raw(const reconstruct_context &context) {
    if (context.result->plan.identity || context.left.data == nullptr) {
        return "";
    }
    return "<h3 style=\"margin-top:22px\">Before rectification</h3>\n<div class=\"grid two\">\n" +
           raw_figure(context.left, context.left_path, "Left") +
           raw_figure(context.right, context.right_path, "Right") + "</div>";
}

std::string report_pictures_maps(const reconstruct_context &context, const report_figures &figures,
                                 const report_grid &grid) {
    return disparity_figure(context, figures, grid) + reason_figure(context, figures, grid) +
           confidence_figure(context, grid) + sigma_figure(context, grid);
}

std::string report_pictures_error(const reconstruct_context &context, const report_figures &figures,
                                  const report_grid &grid) {
    const double limit_px = 4;
    const colormap_table table = colormap_diverging();
    const std::string uri = report_encode_png(
        grid.width_px, grid.height_px,
        report_layers_error(*context.result, figures.truth, grid, limit_px), table);
    const page_ticks ticks = {
        {0, "−4 px, too far"}, {0.25, "−2"}, {0.5, "0"}, {0.75, "+2"}, {1, "+4 px, too near"}};
    return page_figure(
        frame("map", "left", uri, "", "Map of errors", ""),
        "<b>Error</b>: disparity − ground truth." + page_scale(page_gradient(table), ticks));
}

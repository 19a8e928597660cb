// SPDX-License-Identifier: Apache-2.0
#include "tools/host/report/report.hpp"

#include <map>
#include <string>

#include "daemon/base/process.h"
#include "daemon/files/output_file.h"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"
#include "tools/host/report/report_figures.hpp"
#include "tools/host/report/report_layers.hpp"
#include "tools/host/report/report_raw.hpp"
#include "tools/host/report/report_sections.hpp"
#include "tools/host/report/report_still.hpp"

extern "C" {
// Of this folder, embedded by the build.
extern const char *const report_page;
extern const char *const report_style;
extern const char *const report_script;
}

namespace {

/// A number that JavaScript parses exactly; infinities do not occur in the input.
std::string json_number(double value) {
    return report_text_format("%.17g", value);
}

std::string ramp_base64(const colormap_table &table) {
    report_bytes bytes;
    for (const colormap_rgb &colour : table) {
        bytes.insert(bytes.end(), colour.begin(), colour.end());
    }
    return report_encode_base64(bytes);
}

/// R_left_rect, row-major: maps points of the rect frame into the left camera's.
std::string json_rotation(const double R_rect_left[9]) {
    std::string text = "[";
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) {
            text += (row + column > 0 ? "," : "") + json_number(R_rect_left[3 * column + row]);
        }
    }
    return text + "]";
}

/// What the scripts need in addition to the layers.
std::string page_data(const reconstruct_context &context, const report_figures &figures,
                      const report_grid &grid) {
    const rectify_plan &plan = context.result->plan;
    const colormap_table ramp = colormap_sequential();
    std::map<std::string, std::string> fields = {
        {"width", std::to_string(grid.width_px)},
        {"height", std::to_string(grid.height_px)},
        {"step", std::to_string(grid.step)},
        {"full_width", std::to_string(context.result->left.width)},
        {"full_height", std::to_string(context.result->left.height)},
        {"f", json_number(plan.f_px)},
        {"fy", json_number(plan.fy_px)},
        {"cx_left", json_number(plan.cx_left_px)},
        {"cx_right", json_number(plan.cx_right_px)},
        {"cy", json_number(plan.cy_px)},
        {"baseline", json_number(plan.baseline_mm)},
        {"R_left_rect", json_rotation(plan.R_rect_left)},
        {"raw", report_raw_grid(context)},
        {"max_gap_q8", std::to_string(context.options->max_gap_q8)},
        {"unit", report_text_json(figures.unit)},
        {"has_surface",
         figures.has_surface && context.result->triangle_count > 0 ? "true" : "false"},
        {"reason_beyond", std::to_string(REASON_BEYOND)},
        {"has_truth", figures.truth.disparity_px.empty() ? "false" : "true"},
        {"sigma_first", json_number(report_layers_sigma_first_mm)},
        {"sigma_ratio", json_number(report_layers_sigma_ratio)},
        {"sigma_low_code", std::to_string(report_layers_sigma_code(figures.sigma_p2_mm))},
        {"sigma_high_code", std::to_string(report_layers_sigma_code(figures.sigma_p98_mm))},
        {"depth_low", json_number(figures.depth_p1_mm)},
        {"depth_median", json_number(figures.depth_median_mm)},
        {"depth_high", json_number(figures.depth_p99_mm)},
        {"ramp", report_text_json(ramp_base64(ramp))},
        {"ramp_css", report_text_json(page_gradient(ramp))},
    };
    std::string reasons;
    for (int i = 0; i < REASON_COUNT; i++) {
        reasons += (i > 0 ? "," : "") + report_text_json(reason_text(i));
    }
    std::string json = "{\"reasons\":[" + reasons + "]";
    for (const auto &field : fields) {
        json += ",\"" + field.first + "\":" + field.second;
    }
    return json + "}";
}

std::string title_of(const reconstruct_context &context) {
    const capture_info &capture = context.capture;
    if (capture.session != nullptr) {
        return report_text_escape(capture.session) +
               report_text_format(", pair %u", capture.pair->number);
    }
    return "Surface of " + report_text_escape(report_text_file_name(context.left_path)) + " and " +
           report_text_escape(report_text_file_name(context.right_path));
}

std::string meta_of(const reconstruct_context &context) {
    std::string text = "Calibration ";
    if (context.calibration != nullptr) {
        text += report_text_escape(context.calibration->id) +
                report_text_format(" (%08x)", context.result->calibration_crc);
    } else {
        text += "not given";
    }
    return text + " · vergence " + report_text_escape(context.version) + ", build " +
           report_text_escape(context.build_id);
}

/// One line per camera: its position, if known, and the brightness of its image.
std::string cameras_of(const reconstruct_context &context) {
    std::string html;
    const raw_image *images[] = {&context.left, &context.right};
    for (int side = 0; side < RIG_SIDES; side++) {
        std::string text = side == 0 ? "left" : "right";
        if (context.capture.session != nullptr) {
            char line[CAPTURE_INFO_BYTES];
            capture_info_line(&context.capture, 1 + side, line);
            text = line;
        }
        const double percent = report_figures_brightness_percent(*images[side]);
        if (percent >= 0) {
            text += report_text_format("%s brightness %.1f %% (mean)",
                                       context.capture.session != nullptr ? "," : ":", percent);
        }
        html += "<p class=\"meta camera\">" + report_text_escape(text) + "</p>\n";
    }
    return html;
}

/// A part of the page, or nothing after an interruption: on a large result each part takes a good
/// share of the second within which Ctrl-C must stop.
template <typename maker>
std::string unless_interrupted(maker make) {
    return interrupt_requested() ? std::string() : make();
}

std::string make_page(const reconstruct_context &context) {
    const report_figures figures = report_figures_collect(context);
    const report_grid grid = report_layers_grid(*context.result);
    const std::map<std::string, std::string> parts = {
        {"cards", page_cards(report_sections_cards(context, figures))},
        {"notes", report_sections_notes(context, figures)},
        {"viewer_text", figures.has_surface
                            ? "The interactive view needs JavaScript and WebGL. mesh.glb holds the "
                              "same surface for 3D programs."
                            : "No surface was found: there is nothing to draw."},
        {"still", unless_interrupted([&] {
             const std::string uri = report_still(*context.result);
             return uri.empty() ? uri
                                : "<img class=\"still\" id=\"still\" alt=\"The measured surface, "
                                  "seen obliquely\" src=\"" +
                                      uri + "\">";
         })},
        {"pair_text", context.result->right_colour.data != nullptr
                          ? "Corresponding points are on the same row of both images. "
                            "Point at the left image to see its match on the right."
                          : "Made from surface.compact, which has neither the right image nor the "
                            "images before rectification: the report of the pair itself shows "
                            "them."},
        {"pair", unless_interrupted([&] { return report_pictures_pair(context, grid); })},
        {"raw_pair", unless_interrupted([&] { return report_pictures_raw(context); })},
        {"maps", unless_interrupted([&] { return report_pictures_maps(context, figures, grid); })},
        {"accuracy", report_sections_accuracy(context, figures, grid)},
        {"histogram", report_sections_histogram(figures)},
        {"details", report_sections_details(context, figures)},
    };
    page_parts page;
    page.title = title_of(context);
    page.meta = page_meta(meta_of(context)) + cameras_of(context);
    page.body = report_text_fill(report_page, parts);
    page.footer =
        "Lengths in the left camera's frame: X to the right, Y down, Z forward. Pixel (0, 0) is "
        "the "
        "centre of the top left pixel.";
    page.after =
        "<div id=\"readout\" class=\"readout\" hidden><output id=\"readout-text\"></output></div>\n"
        "<script type=\"application/json\" id=\"page-data\">" +
        page_data(context, figures, grid) +
        "</script>\n<script type=\"text/plain\" id=\"page-layers\">" + unless_interrupted([&] {
            return report_layers_pack(*context.result, figures.truth, grid);
        }) +
        "</script>";
    page.style = report_style;
    page.script = report_script;
    return page_make(page);
}

}  // namespace

int report_write(const struct reconstruct_context *context, const char *path,
                 struct message *message) {
    const std::string page = make_page(*context);
    output_file file;
    output_file_open(&file, path);
    output_file_write(&file, page.data(), page.size());
    return output_file_close(&file, message);
}

// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>

#include "console/pair/calibration_match.h"
#include "core/error.h"
#include "core/math.h"
#include "daemon/surface/length_check.h"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/rectify.h"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/info/info.hpp"

namespace {

using json = nlohmann::ordered_json;

std::string pair_text(double a, double b, int digits, const char *between) {
    return number_text(a, digits) + between + number_text(b, digits);
}

/// Angle between the rays through two pixels of a row or of a column, in degrees; negative where
/// there is no ray. Of an equidistant lens in two parts: the whole may exceed 180 degrees.
double angle_deg(const lens &camera, double x0, double y0, double x1, double y1) {
    const double pixel_px[3][2] = {{x0, y0}, {(x0 + x1) / 2, (y0 + y1) / 2}, {x1, y1}};
    double ray[3][3], normal[3], sum = 0;
    for (int i = 0; i < 3; i++) {
        if (!lens_ray(&camera, pixel_px[i], ray[i])) {
            return -1;
        }
    }
    const int step = camera.kind == LENS_EQUIDISTANT ? 1 : 2;
    for (int i = 0; i < 2; i += step) {
        geometry_cross(ray[i], ray[i + step], normal);
        sum += MATH_DEGREE_PER_RAD *
               std::atan2(geometry_norm(normal), geometry_dot(ray[i], ray[i + step]));
    }
    return sum;
}

json lens_json(const lens &camera, double across_deg, double down_deg) {
    json result = {
        {"size_px", {camera.width_px, camera.height_px}},
        {"focal_px", {camera.fx_px, camera.fy_px}},
        {"centre_px", {camera.cx_px, camera.cy_px}},
        {"model", lens_kind_name(camera.kind)},
        {"distortion_k1_k2_p1_p2_k3", {camera.k1, camera.k2, camera.p1, camera.p2, camera.k3}},
        {"field_of_view_deg", {across_deg, down_deg}}};
    if (camera.kind != LENS_BROWN_CONRADY) {
        result["distortion_k4_k5_k6"] = {camera.k4, camera.k5, camera.k6};
    }
    return result;
}

/// The coefficients that the lens's model has.
std::string distortion_text(const lens &camera) {
    if (lens_is_ideal(&camera)) {
        return "none";
    }
    const bool equidistant = camera.kind == LENS_EQUIDISTANT;
    std::string text =
        camera.kind == LENS_BROWN_CONRADY ? "" : std::string(lens_kind_name(camera.kind)) + ", ";
    text += "k1 " + number_text(camera.k1, 6) + ", k2 " + number_text(camera.k2, 6);
    if (!equidistant) {
        text += ", p1 " + number_text(camera.p1, 6) + ", p2 " + number_text(camera.p2, 6);
    }
    text += ", k3 " + number_text(camera.k3, 6);
    if (camera.kind != LENS_BROWN_CONRADY) {
        text += ", k4 " + number_text(camera.k4, 6);
    }
    if (camera.kind == LENS_RATIONAL) {
        text += ", k5 " + number_text(camera.k5, 6) + ", k6 " + number_text(camera.k6, 6);
    }
    return text;
}

void add_lens(const std::string &key, const lens &camera, info_page *page) {
    const double middle_x = (camera.width_px - 1) / 2.0, middle_y = (camera.height_px - 1) / 2.0;
    const double across_deg = angle_deg(camera, -0.5, middle_y, camera.width_px - 0.5, middle_y);
    const double down_deg = angle_deg(camera, middle_x, -0.5, middle_x, camera.height_px - 0.5);
    const std::string text = std::to_string(camera.width_px) + " x " +
                             std::to_string(camera.height_px) + " px, focal length " +
                             pair_text(camera.fx_px, camera.fy_px, 7, " x ") + " px, centre " +
                             pair_text(camera.cx_px, camera.cy_px, 7, " ") + " px";
    page->add(key, key + " camera", text, lens_json(camera, across_deg, down_deg));
    page->add("", "  distortion", distortion_text(camera), nullptr);
    if (across_deg >= 0 && down_deg >= 0) {
        page->add("", "  field of view", pair_text(across_deg, down_deg, 4, " x ") + " degrees",
                  nullptr);
    }
}

void add_pose(const calibration &value, info_page *page) {
    const double *r_rad = value.rotation_right_left_rad;
    const double *t_mm = value.translation_right_left_mm;
    page->add_number("baseline_mm", "baseline", calibration_baseline_mm(&value), 7, "mm");
    page->add("translation_right_left_mm", "  translation",
              number_text(t_mm[0], 7) + " " + number_text(t_mm[1], 6) + " " +
                  number_text(t_mm[2], 6) + " mm (left camera in the right frame)",
              json::array({t_mm[0], t_mm[1], t_mm[2]}));
    page->add("rotation_right_left_rad", "  rotation",
              number_text(MATH_DEGREE_PER_RAD * geometry_norm(r_rad), 4) + " degrees (vector " +
                  number_text(r_rad[0], 6) + " " + number_text(r_rad[1], 6) + " " +
                  number_text(r_rad[2], 6) + " rad)",
              json::array({r_rad[0], r_rad[1], r_rad[2]}));
    const double vergence_mm = calibration_vergence_depth_mm(&value);
    page->add("vergence_depth_mm", "  axes meet",
              vergence_mm > 0 ? "at a depth of " + number_text(vergence_mm, 5) + " mm"
                              : "nowhere in front of the cameras",
              vergence_mm > 0 ? json(vergence_mm) : json(nullptr));
}

/// Depth of one pixel of disparity: dz/dd = z^2 / (f B).
void add_depth_steps(const calibration &value, const rectify_plan &plan, info_page *page) {
    const double vergence_mm = calibration_vergence_depth_mm(&value);
    std::vector<double> depths_mm;
    if (value.depth_far_mm > 0) {
        const double near_mm = value.depth_near_mm, far_mm = value.depth_far_mm;
        depths_mm = {near_mm, std::sqrt(near_mm * std::min(far_mm, 100 * near_mm)),
                     std::min(far_mm, 100 * near_mm)};
    } else if (vergence_mm > 0 && vergence_mm < 20 * plan.baseline_mm) {
        depths_mm = {vergence_mm / 1.5, vergence_mm, vergence_mm * 2};
    } else {
        depths_mm = {5 * plan.baseline_mm, 10 * plan.baseline_mm, 20 * plan.baseline_mm,
                     50 * plan.baseline_mm};
    }
    json list = json::array();
    bool first = true;
    for (const double depth_mm : depths_mm) {
        const double step_mm = depth_mm * depth_mm / (plan.f_px * plan.baseline_mm);
        page->add("", first ? "one pixel is" : "",
                  number_text(step_mm, 3) + " mm of depth at " + number_text(depth_mm, 4) + " mm",
                  nullptr);
        list.push_back({{"depth_mm", depth_mm}, {"mm_per_px", step_mm}});
        first = false;
    }
    page->add("depth_per_pixel", "", "", list);
}

/// The options of reconstruct that search this range of depths, to change and paste.
std::string range_options(const rectify_plan &plan) {
    const auto whole = [](double mm) { return number_text(mm, 4); };
    return "--near " + whole(plan.depth_near_mm) +
           (std::isfinite(plan.depth_far_mm) ? " --far " + whole(plan.depth_far_mm) : "");
}

void add_plan(const calibration &value, info_page *page) {
    rectify_options options{};
    options.scale = 1;
    rectify_plan plan;
    const int code = rectify_plan_make(&value, &options, &plan);
    if (code != ERROR_OK) {
        message why;
        const bool in_line = code == ERROR_OVERLAP && length_check_in_line(&value, &why);
        const char *const text = in_line ? why.text : error_text(code);
        page->add("rectified_pair", "rectified pair",
                  std::string("cannot be made by default: ") + text, {{"error", text}});
        return;
    }
    add_depth_steps(value, plan, page);
    const int last = plan.disparity_min + plan.disparity_count - 1;
    const double across_deg = report_field_deg(plan.cx_left_px, plan.width_px, plan.f_px);
    const double down_deg = report_field_deg(plan.cy_px, plan.height_px, plan.fy_px);
    page->add("rectified_pair", "rectified pair",
              std::to_string(plan.width_px) + " x " + std::to_string(plan.height_px) +
                  " px, focal length " + number_text(plan.f_px, 7) + " px, " +
                  pair_text(across_deg, down_deg, 4, " x ") + " degrees" +
                  (plan.identity ? ", pixel for pixel" : ""),
              {{"size_px", {plan.width_px, plan.height_px}},
               {"field_of_view_deg", {across_deg, down_deg}},
               {"focal_px", plan.f_px},
               {"identity", plan.identity},
               {"disparity_min_px", plan.disparity_min},
               {"disparity_max_px", last},
               {"depth_near_mm", plan.depth_near_mm},
               {"depth_far_mm",
                std::isfinite(plan.depth_far_mm) ? json(plan.depth_far_mm) : json(nullptr)},
               {"depth_range_assumed", plan.depth_range_assumed}});
    page->add(
        "", "  searched",
        "disparities " + std::to_string(plan.disparity_min) + ".." + std::to_string(last) +
            " px, depths " + number_text(plan.depth_near_mm, 4) + ".." +
            (std::isfinite(plan.depth_far_mm) ? number_text(plan.depth_far_mm, 4) + " mm"
                                              : std::string("infinity")) +
            (plan.depth_range_assumed ? " (assumed; reconstruct takes " + range_options(plan) + ")"
                                      : ""),
        nullptr);
}

std::string axis_text(const calibration_axis &stood, int axis) {
    if (stood.kind == CALIBRATION_AXIS_KNOWN) {
        const char *unit = axis == CALIBRATION_PAN ? " deg" : "";
        return number_text_with_sigma(stood.mean, stood.spread) + unit;
    }
    return stood.kind == CALIBRATION_AXIS_NONE ? "none" : "not known";
}

/// What it was made with, if its text states it.
void add_origin(const calibration &value, info_page *page) {
    static const char *const sides[] = {"left", "right"};
    if (!value.has_origin) {
        page->add("origin", "made with", "not known", nullptr);
        return;
    }
    const auto or_null = [](const char *text) {
        return *text != '\0' ? json(text) : json(nullptr);
    };
    const calibration_origin &origin = value.origin;
    json object = {{"instrument", or_null(origin.instrument)}};
    page->add("", "made with", *origin.instrument != '\0' ? origin.instrument : "not known",
              nullptr);
    for (size_t side = 0; side < 2; side++) {
        const calibration_side_origin &at = origin.side[side];
        std::string text = *at.camera != '\0' ? at.camera : "camera not known";
        json &one = object[sides[side]];
        one = {{"camera", or_null(at.camera)}, {"window", nullptr}};
        if (at.window.skip > 0) {
            text += ", window at " + std::to_string(at.window.column_px) + " " +
                    std::to_string(at.window.row_px) + ", skip " + std::to_string(at.window.skip);
            one["window"] = {at.window.column_px, at.window.row_px, at.window.skip};
        }
        for (int axis = 0; axis < CALIBRATION_AXES; axis++) {
            const calibration_axis &stood = at.axis[axis];
            const bool known = stood.kind == CALIBRATION_AXIS_KNOWN;
            text += std::string(", ") + calibration_reply_axis_name(axis) + " " +
                    axis_text(stood, axis);
            one[calibration_reply_axis_name(axis)] =
                known ? json({{"mean", stood.mean}, {"spread", stood.spread}}) : json(nullptr);
        }
        page->add("", std::string("  ") + sides[side], text, nullptr);
    }
    page->add("origin", "", "", object);
    page->add("scale_sigma", "  uncertain by",
              number_text(100 * value.scale_sigma, 3) + " % of all depths, and " +
                  number_text(MATH_DEGREE_PER_RAD * value.yaw_sigma_rad, 3) +
                  " degrees between the cameras",
              value.scale_sigma);
    page->add("yaw_sigma_rad", "", "", value.yaw_sigma_rad);
}

/// What the calibration is, and where it came from.
void add_identity(const calibration &value, const calibration_file_report &report,
                  info_page *page) {
    char crc[16];
    std::snprintf(crc, sizeof crc, "%08x", calibration_crc(&value));
    page->add("format", "format", report.format, report.format);
    std::string files;
    for (const std::string &file : report.files) {
        files += (files.empty() ? "" : ", ") + file;
    }
    if (report.files.size() > 1) {
        page->add("files", "files", files, report.files);
    }
    page->add("id", "id", value.id, value.id);
    page->add("crc32", "crc32", crc, crc);
    page->add("date", "date", *value.date != '\0' ? value.date : "unknown",
              *value.date != '\0' ? json(value.date) : json(nullptr));
    page->add("note", "note", *value.note != '\0' ? value.note : "-", value.note);
    bool first = true;
    for (const std::string &sentence : report.assumed) {
        page->add("", first ? "assumed" : "", sentence, nullptr);
        first = false;
    }
    page->add("assumed", "", "", report.assumed);
}

}  // namespace

info_page info_calibration(const std::string &path, const calibration &value,
                           const calibration_file_report &report) {
    info_page page;
    page.path = path;
    page.kind = "calibration (" + report.format + ")";
    add_identity(value, report, &page);
    page.add("rectified", "rectified",
             value.rectified ? "yes: images pass through unchanged" : "no", value.rectified);
    add_origin(value, &page);
    add_lens("left", value.left, &page);
    add_lens("right", value.right, &page);
    add_pose(value, &page);
    const bool stated = value.depth_far_mm > 0;
    page.add(
        "depth_range_mm", "depth range",
        stated ? pair_text(value.depth_near_mm, value.depth_far_mm, 7, "..") + " mm" : "not stated",
        stated ? json::array({value.depth_near_mm, value.depth_far_mm}) : json(nullptr));
    page.add("rms_px", "rms",
             value.rms_px > 0 ? number_text(value.rms_px, 4) + " px" : "not stated",
             value.rms_px > 0 ? json(value.rms_px) : json(nullptr));
    add_plan(value, &page);
    return page;
}

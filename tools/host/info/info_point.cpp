// SPDX-License-Identifier: Apache-2.0
/// Where a pixel of a result's maps comes from: its pixels in the two raw images.
#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "stereo/geometry/calibration.h"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/lens.h"
#include "tools/host/formats/pfm.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/info/info.hpp"

namespace {

using json = nlohmann::ordered_json;

/// The raw pixel that rectification samples for column `x_px` of one side. False: outside the lens.
bool raw_pixel(const json &plan, const char *side, const lens &lens, double x_px, double y_px,
               double shrunk_by, double raw_px[2]) {
    const std::string name = side;
    double rotation[9], ray[3];
    for (size_t i = 0; i < 9; i++) {
        rotation[i] = plan.at("R_rect_" + name).at(i).get<double>();
    }
    const double point[3] = {
        (x_px - plan.at("cx_" + name + "_px").get<double>()) / plan.at("f_px").get<double>(),
        (y_px - plan.at("cy_px").get<double>()) / plan.at("fy_px").get<double>(), 1};
    geometry_rotate_back(rotation, point, ray);
    if (!lens_project(&lens, ray, raw_px)) {
        return false;
    }
    for (int i = 0; i < 2; i++) {
        raw_px[i] = (raw_px[i] + 0.5) * shrunk_by - 0.5;
    }
    return true;
}

/// The disparity at the nearest pixel of disparity.pfm beside result.json; infinity: not measured.
bool disparity_at(const std::string &path, const double at_px[2], double *disparity,
                  std::string *message) {
    const size_t slash = path.rfind('/');
    pfm_image map;
    if (!pfm_read((slash == std::string::npos ? "" : path.substr(0, slash + 1)) + "disparity.pfm",
                  &map, message)) {
        return false;
    }
    if (!(at_px[0] > -0.5 && at_px[0] < map.width_px - 0.5 && at_px[1] > -0.5 &&
          at_px[1] < map.height_px - 0.5)) {
        *message = report_text_format("--at: outside of the maps, which have %d x %d px",
                                      map.width_px, map.height_px);
        return false;
    }
    const auto column = static_cast<size_t>(std::lround(at_px[0]));
    const auto row = static_cast<size_t>(std::lround(at_px[1]));
    *disparity = map.values[row * static_cast<size_t>(map.width_px) + column];
    return true;
}

}  // namespace

bool info_is_point(const std::string &text, double at_px[2]) {
    char rest = 0;
    return std::sscanf(text.c_str(), "%lf,%lf%c", &at_px[0], &at_px[1], &rest) == 2;
}

bool info_point(const std::string &path, const double at_px[2], info_page *page,
                std::string *message) {
    const json document = page->rows.empty() ? json() : page->rows.back().value;
    const json text = document.value(json::json_pointer("/calibration/text"), json());
    const json plan = document.value("plan", json());
    calibration rig;
    calibration_fault fault{};
    if (!text.is_string() || !plan.is_object() ||
        calibration_parse(text.get<std::string>().data(), text.get<std::string>().size(), &rig,
                          &fault) != ERROR_OK) {
        *message = path + ": does not state its cameras (reconstruct the pair again)";
        return false;
    }
    double disparity = 0, left[2], right[2];
    if (!disparity_at(path, at_px, &disparity, message)) {
        return false;
    }
    const double shrunk_by = document.value(json::json_pointer("/input/shrunk_by"), 1.0);
    if (!raw_pixel(plan, "left", rig.left, at_px[0], at_px[1], shrunk_by, left)) {
        *message = path + ": --at: outside of the left image";
        return false;
    }
    page->kind =
        report_text_format("pixel %.1f,%.1f of a reconstruction's maps", at_px[0], at_px[1]);
    page->rows.clear();
    page->add("left_px", "left image", report_text_format("%.2f,%.2f px", left[0], left[1]),
              {left[0], left[1]});
    if (!std::isfinite(disparity) ||
        !raw_pixel(plan, "right", rig.right, at_px[0] - disparity, at_px[1], shrunk_by, right)) {
        page->add("", "right image", "not measured here", nullptr);
        return true;
    }
    page->add("right_px", "right image", report_text_format("%.2f,%.2f px", right[0], right[1]),
              {right[0], right[1]});
    page->add("disparity_px", "disparity", report_text_format("%.2f px", disparity), disparity);
    page->add("", "as a mark",
              report_text_format("%.2f,%.2f,%.2f,%.2f (for --from and --to of calibrate)", left[0],
                                 left[1], right[0], right[1]),
              nullptr);
    return true;
}

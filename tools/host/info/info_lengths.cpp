// SPDX-License-Identifier: Apache-2.0
/// Depths, distances and planes of a written result, from its points.pcd.
#include <cmath>
#include <cstring>
#include <fstream>

#include "stereo/geometry/geometry.h"
#include "tools/host/fit/fit.hpp"
#include "tools/host/formats/own_points.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/info/info.hpp"

namespace {

using json = nlohmann::ordered_json;

/// The points of a result, with the pixels that they were measured at.
class result_points {
  public:
    result_points(const json &plan, std::string path) : path_(std::move(path)) {
        for (size_t i = 0; i < 9; i++) {
            rotation_[i] = plan.at("R_rect_left").at(i).get<double>();
        }
        f_px_ = plan.at("f_px").get<double>();
        fy_px_ = plan.at("fy_px").get<double>();
        cx_px_ = plan.at("cx_left_px").get<double>();
        cy_px_ = plan.at("cy_px").get<double>();
        width_px = plan.at("width_px").get<int>();
        height_px = plan.at("height_px").get<int>();
    }

    /// Those inside of x, y, width, height.
    bool read(const std::array<int, 4> &region, std::vector<fit_point> *points,
              std::string *message) const {
        std::ifstream stream(path_, std::ios::binary);
        if (!stream) {
            *message = path_ + ": missing (reconstruct with points.pcd among the --files)";
            return false;
        }
        size_t count;
        double unit_mm;
        if (!own_points_header(stream, &count, &unit_mm)) {
            *message = path_ + ": not the points of a metric result, or damaged";
            return false;
        }
        for (size_t i = 0; i < count; i++) {
            float values[5];
            if (!stream.read(reinterpret_cast<char *>(values), sizeof values)) {
                *message = path_ + ": truncated";
                return false;
            }
            const fit_point point = point_of(values, unit_mm);
            if (point.x_px >= region[0] && point.x_px < region[0] + region[2] &&
                point.y_px >= region[1] && point.y_px < region[1] + region[3]) {
                points->push_back(point);
            }
        }
        return true;
    }

    int width_px, height_px;

  private:
    fit_point point_of(const float values[5], double unit_mm) const {
        fit_point point{};
        for (int i = 0; i < 3; i++) {
            point.position_mm[i] = unit_mm * static_cast<double>(values[i]);
        }
        point.sigma_mm = unit_mm * static_cast<double>(values[4]);
        double at[3];
        geometry_rotate(rotation_, point.position_mm, at);
        const double x_px = cx_px_ + f_px_ * at[0] / at[2], y_px = cy_px_ + fy_px_ * at[1] / at[2];
        const double limit = 1e6;
        point.x_px = std::abs(x_px) < limit ? static_cast<int>(std::lround(x_px)) : -1;
        point.y_px = std::abs(y_px) < limit ? static_cast<int>(std::lround(y_px)) : -1;
        return point;
    }

    std::string path_;
    double rotation_[9], f_px_, fy_px_, cx_px_, cy_px_;
};

json json_of(const fit_value &value) {
    return {{"value", value.value},
            {"sigma", value.sigma},
            {"sigma_common", value.sigma_common >= 0 ? json(value.sigma_common) : json()}};
}

std::string text_of(const fit_value &value, const char *unit) {
    return number_text_with_sigma(value.value, value.sigma) + " " + unit +
           (value.sigma_common >= 0
                ? " (of which " + number_text(value.sigma_common, 2) + " common to all points)"
                : "");
}

bool point_at(const result_points &points, double x_px, double y_px, fit_point *point,
              std::string *message) {
    std::vector<fit_point> found;
    const std::array<int, 4> region = {static_cast<int>(std::lround(x_px)),
                                       static_cast<int>(std::lround(y_px)), 1, 1};
    const std::string place =
        "pixel " + std::to_string(region[0]) + "," + std::to_string(region[1]);
    if (region[0] < 0 || region[1] < 0 || region[0] >= points.width_px ||
        region[1] >= points.height_px) {
        *message = place + report_text_format(": outside of the maps, which have %d x %d px",
                                              points.width_px, points.height_px);
        return false;
    }
    if (!points.read(region, &found, message)) {
        return false;
    }
    if (found.empty()) {
        *message = place + ": not measured here";
        return false;
    }
    *point = found[0];
    return true;
}

bool add_plane(const result_points &points, const double region[4], const fit_common &common,
               info_page *page, std::string *message) {
    const std::array<int, 4> place = {static_cast<int>(region[0]), static_cast<int>(region[1]),
                                      static_cast<int>(region[2]), static_cast<int>(region[3])};
    if (region[2] < 1 || region[3] < 1 || region[0] + region[2] > points.width_px ||
        region[1] + region[3] > points.height_px) {
        *message = report_text_format(
            "--plane: region %d,%d,%d,%d is empty or not within the maps, which have %d x %d px",
            place[0], place[1], place[2], place[3], points.width_px, points.height_px);
        return false;
    }
    std::vector<fit_point> found;
    fit_plane_result plane;
    if (!points.read(place, &found, message)) {
        return false;
    }
    if (!fit_plane(found, common, &plane, message)) {
        *message = "--plane: " + *message;
        return false;
    }
    page->add("plane", "plane", text_of(plane.distance_mm, "mm from the left camera"),
              {{"distance_mm", json_of(plane.distance_mm)},
               {"tilt_deg", json_of(plane.tilt_deg)},
               {"normal", plane.normal},
               {"normal_sigma_deg", plane.normal_sigma_deg},
               {"centre_mm", plane.centre_mm},
               {"rms_mm", plane.rms_mm},
               {"points", plane.points},
               {"used", plane.used}});
    page->add("", "tilt", text_of(plane.tilt_deg, "degrees against the left camera's axis"),
              nullptr);
    page->add("", "flat",
              number_text(plane.rms_mm, 3) + " mm rms, " + std::to_string(plane.used) + " of " +
                  std::to_string(plane.points) + " points",
              nullptr);
    return true;
}

}  // namespace

bool info_lengths(const std::string &path, const info_places &places, info_page *page,
                  std::string *message) {
    const json document = page->rows.empty() ? json() : page->rows.back().value;
    const json plan = document.value("plan", json());
    if (!plan.is_object() || document.value("metric", json()) != true) {
        *message = path + ": the geometry is assumed: lengths mean nothing";
        return false;
    }
    const size_t slash = path.rfind('/');
    const result_points points(
        plan, (slash == std::string::npos ? "" : path.substr(0, slash + 1)) + "points.pcd");
    const json sigma = document.value("depth_sigma_common_mm", json());
    const fit_common common = {sigma.is_number() ? sigma.get<double>() : -1,
                               document.at("depth_mm").at("median").get<double>()};
    page->kind = "lengths in a reconstruction";
    page->rows.clear();
    fit_point from, to;
    if (places.depth != nullptr) {
        if (!point_at(points, places.depth[0], places.depth[1], &from, message)) {
            return false;
        }
        const fit_value depth = fit_depth(from, common);
        page->add("depth_mm", "depth", text_of(depth, "mm"), json_of(depth));
    }
    if (places.distance != nullptr) {
        if (!point_at(points, places.distance[0], places.distance[1], &from, message) ||
            !point_at(points, places.distance[2], places.distance[3], &to, message)) {
            return false;
        }
        const fit_value distance = fit_distance(from, to, common);
        page->add("distance_mm", "distance", text_of(distance, "mm"), json_of(distance));
    }
    return places.plane == nullptr || add_plane(points, places.plane, common, page, message);
}

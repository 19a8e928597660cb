// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/recording_result.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "core/error.h"
#include "tools/host/formats/json_limited.hpp"
#include "tools/host/formats/own_points.hpp"
#include "tools/host/formats/pfm.hpp"

namespace {

using json = nlohmann::ordered_json;

constexpr double metre_mm = 1000;
constexpr float disparity_step_px = 1.0f / 256;

/// ROS computes depths as f T / d: what our cameras differ in cx is taken off. Pixels without a
/// disparity are below `min_px`.
void fill_disparity(const pfm_image &map, double offset_px, ros_disparity *out) {
    float low_px = std::numeric_limits<float>::infinity(), high_px = -low_px;
    std::vector<float> values(map.values);
    for (float &value : values) {
        if (std::isfinite(value)) {
            value = static_cast<float>(static_cast<double>(value) - offset_px);
            low_px = std::min(low_px, value);
            high_px = std::max(high_px, value);
        }
    }
    if (low_px > high_px) {
        low_px = high_px = 0;
    }
    record_writer bytes;
    for (const float value : values) {
        bytes.f32(std::isfinite(value) ? value : low_px - 1);
    }
    ros_image &image = out->image;
    image.width_px = static_cast<uint32_t>(map.width_px);
    image.height_px = static_cast<uint32_t>(map.height_px);
    image.encoding = "32FC1";
    image.row_bytes = image.width_px * static_cast<uint32_t>(sizeof(float));
    image.data = std::move(bytes.bytes);
    out->min_px = low_px;
    out->max_px = high_px;
    out->step_px = disparity_step_px;
}

bool fill_points(const std::string &path, ros_points *points, std::string *why) {
    std::ifstream stream(path, std::ios::binary);
    size_t count = 0;
    double unit_mm = 0;
    if (!stream) {
        return true;  // the result was written without it
    }
    if (!own_points_header(stream, &count, &unit_mm)) {
        *why = path + ": not the points of a metric result, or damaged";
        return false;
    }
    points->fields = {"x", "y", "z", "rgb", "sigma"};
    record_writer bytes;
    for (size_t i = 0; i < count; i++) {
        char raw[20];
        if (!stream.read(raw, sizeof raw)) {
            *why = path + ": truncated";
            return false;
        }
        byte_reader in(raw, sizeof raw);
        for (int field = 0; field < 5; field++) {
            const auto value = in.number<float>();
            const bool length = field != 3;
            bytes.f32(length ? static_cast<float>(static_cast<double>(value) * unit_mm / metre_mm)
                             : value);
        }
    }
    points->count = static_cast<uint32_t>(count);
    points->data = std::move(bytes.bytes);
    return true;
}

}  // namespace

int recording_result_read(const std::string &directory, recording_result *result,
                          std::string *why) {
    const std::string path = directory + "/result.json";
    std::ifstream stream(path);
    if (!stream) {
        *why = path + ": missing (name the directory of a result)";
        return ERROR_ARGUMENT;
    }
    bool too_deep;
    const json document = json_limited(stream, 16, &too_deep);
    pfm_image map;
    try {
        if (!document.at("metric").get<bool>()) {
            *why = directory + ": its lengths are assumed (reconstruct with a calibration)";
            return ERROR_ARGUMENT;
        }
        if (document.at("capture").is_object()) {
            result->pair = document.at("capture").at("pair").get<unsigned>();
        }
        const json &plan = document.at("plan");
        for (size_t i = 0; i < 9; i++) {
            result->rotation_rect_left[i] = plan.at("R_rect_left").at(i).get<double>();
        }
        if (!pfm_read(directory + "/disparity.pfm", &map, why)) {
            return ERROR_ARGUMENT;
        }
        result->disparity.f_px = plan.at("f_px").get<double>();
        result->disparity.baseline_m = plan.at("baseline_mm").get<double>() / metre_mm;
        fill_disparity(map,
                       plan.at("cx_left_px").get<double>() - plan.at("cx_right_px").get<double>(),
                       &result->disparity);
    } catch (const json::exception &) {
        *why = path + ": damaged, or of another version";
        return ERROR_SYNTAX;
    }
    return fill_points(directory + "/points.pcd", &result->points, why) ? ERROR_OK : ERROR_SYNTAX;
}

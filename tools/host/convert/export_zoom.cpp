// SPDX-License-Identifier: Apache-2.0
#include "tools/host/convert/export_zoom.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/invariant.h"
#include "stereo/zoom/zoom_aim.h"

namespace {

using json = nlohmann::ordered_json;

const int zooms = 25;  // both programs interpolate in straight lines
const char *const sides[2] = {"left", "right"};

/// The camera at a part (0 to 1) of its ranges of zoom and focus.
zoom_pair pair_at(const zoom_calibration &value, double zoom, double focus) {
    zoom_state state{};
    for (int side = 0; side < 2; side++) {
        const zoom_camera &camera = value.camera[side];
        state.side[side].zoom_counts = camera.zoom.min + zoom * (camera.zoom.max - camera.zoom.min);
        state.side[side].focus_counts =
            camera.focus.min + focus * (camera.focus.max - camera.focus.min);
    }
    zoom_pair pair;
    zoom_pair_at(value.camera, &state, &pair);
    return pair;
}

/// The part of the focus range that is focused at infinity, or the nearest to it.
double infinity_part(const zoom_camera &camera, double zoom) {
    const double counts = zoom_focus_counts(
        &camera, camera.zoom.min + zoom * (camera.zoom.max - camera.zoom.min), 1e9);
    const double part = (counts - camera.focus.min) / (camera.focus.max - camera.focus.min);
    return std::min(std::max(part, 0.0), 1.0);
}

json gyroflow_lens(const lens &lens, double f_mm) {
    return {{"camera_matrix",
             {{lens.fx_px, 0.0, lens.cx_px}, {0.0, lens.fy_px, lens.cy_px}, {0.0, 0.0, 1.0}}},
            {"distortion_coeffs", {lens.k1, lens.k2, lens.p1, lens.p2, lens.k3}},
            {"focal_length", f_mm}};
}

json gyroflow(const zoom_calibration &value, int side) {
    const zoom_camera &camera = value.camera[side];
    json table = json::object(), first;
    for (int i = 0; i < zooms; i++) {
        const double zoom = i / (zooms - 1.0);
        const zoom_pair pair = pair_at(value, zoom, infinity_part(camera, zoom));
        const double f_mm = pair.side[side].f_px * camera.pixel_mm;
        char name[32];
        std::snprintf(name, sizeof name, "%.4f", f_mm);
        table[name] = gyroflow_lens(pair.side[side].lens, f_mm);
        first = i == 0 ? table[name] : first;
    }
    const json size = {{"w", camera.width_px}, {"h", camera.height_px}};
    return {{"name", std::string(value.id) + " " + sides[side]},
            {"note", value.note},
            {"calibrated_by", "vergence"},
            {"camera_brand", value.instrument},
            {"camera_model", camera.name},
            {"lens_model", sides[side]},
            {"calib_dimension", size},
            {"orig_dimension", size},
            {"distortion_model", "opencv_standard"},
            {"focal_length", first["focal_length"]},
            {"fisheye_params",
             {{"RMS_error", value.validation.rms_px},
              {"camera_matrix", first["camera_matrix"]},
              {"distortion_coeffs", first["distortion_coeffs"]}}},
            {"interpolations", table}};
}

json opentrackio_sample(const zoom_calibration &value, int side, double zoom, double focus) {
    const zoom_camera &camera = value.camera[side];
    const zoom_pair pair = pair_at(value, zoom, focus);
    const lens &lens = pair.side[side].lens;
    const double focus_dioptre = pair.side[side].focus_dioptre;
    // Millimetres on the sensor; y is up there.
    const double x_mm = (lens.cx_px - (camera.width_px - 1) / 2.0) * camera.pixel_mm;
    const double y_mm = -(lens.cy_px - (camera.height_px - 1) / 2.0) * camera.pixel_mm;
    json result = {
        {"encoders", {{"focus", focus}, {"zoom", zoom}}},
        {"pinholeFocalLength", lens.fx_px * camera.pixel_mm},
        {"entrancePupilOffset",
         zoom_function_value(&camera, ZOOM_PUPIL, std::log(pair.side[side].f_px)) / 1000},
        {"projectionOffset", {{"x", x_mm}, {"y", y_mm}}},
        {"distortion", json::array({{{"model", "Brown-Conrady U-D"},
                                     {"radial", {lens.k1, lens.k2, lens.k3}},
                                     {"tangential", {lens.p1, lens.p2}}}})}};
    if (focus_dioptre > 1e-4) {  // 10 km
        result["focusDistance"] = 1 / focus_dioptre;
    }
    return result;
}

json opentrackio(const zoom_calibration &value, int side) {
    const zoom_camera &camera = value.camera[side];
    const json fixed = {
        {"camera",
         {{"activeSensorPhysicalDimensions",
           {{"width", camera.width_px * camera.pixel_mm},
            {"height", camera.height_px * camera.pixel_mm}}},
          {"activeSensorResolution", {{"width", camera.width_px}, {"height", camera.height_px}}},
          {"model", value.instrument},
          {"label", sides[side]}}},
        {"lens", {{"calibrationHistory", {std::string("vergence ") + value.id}}}}};
    json samples = json::array();
    for (int i = 0; i < zooms; i++) {
        for (const double focus : {0.0, 0.5, 1.0}) {
            samples.push_back(
                {{"protocol", {{"name", "OpenTrackIO"}, {"version", {1, 0, 0}}}},
                 {"static", fixed},
                 {"lens", opentrackio_sample(value, side, i / (zooms - 1.0), focus)}});
        }
    }
    return samples;
}

}  // namespace

const char *const export_zoom_formats = "gyroflow opentrackio";

std::vector<export_file> export_zoom(const zoom_calibration &value, const std::string &format) {
    INVARIANT(format == "gyroflow" || format == "opentrackio");
    std::vector<export_file> files;
    for (int side = 0; side < 2; side++) {
        const json table = format == "gyroflow" ? gyroflow(value, side) : opentrackio(value, side);
        files.push_back({std::string(sides[side]) + ".json",
                         table.dump(1, ' ', false, json::error_handler_t::replace) + "\n",
                         format == "gyroflow" && side == 0
                             ? "the table holds the lens focused at infinity: it "
                               "has no focus axis"
                             : ""});
    }
    return files;
}

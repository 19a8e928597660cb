// SPDX-License-Identifier: Apache-2.0
/// The settings of ORB-SLAM2 and 3 for a stereo camera, in one file, lengths in m:
/// - LEFT.K LEFT.D LEFT.R LEFT.P and RIGHT.*: raw pictures, which the program rectifies itself;
/// - Camera.fx ... and Camera.bf (or Camera1.fx ... and Stereo.b): pictures are rectified;
/// - Camera1.fx, Camera1.k1 ..., Camera2.* and Stereo.T_c1_c2 (or Tlr), which maps points of the
///   right camera into the left one.
#include <cmath>

#include "core/error.h"
#include "tools/host/convert/import.hpp"
#include "tools/host/convert/import_storage.hpp"

namespace {

class settings {
  public:
    explicit settings(const import_file &file) : file_(file) {
        for (const import_storage_entry &entry : import_storage_read(file)) {
            entries_[entry.name] = entry;
        }
    }

    bool has(const std::string &name) const { return entries_.count(name) > 0; }

    double number(const std::string &name) const {
        return values(name, import_storage_kind::number, 1)[0];
    }

    double number_or_zero(const std::string &name) const { return has(name) ? number(name) : 0; }

    std::vector<double> matrix(const std::string &name, size_t count) const {
        return values(name, import_storage_kind::matrix, count);
    }

    /// Of any length.
    std::vector<double> row(const std::string &name) const {
        return matrix(name, has(name) ? entries_.at(name).numbers.size() : 0);
    }

  private:
    std::vector<double> values(const std::string &name, import_storage_kind kind,
                               size_t count) const {
        if (!has(name)) {
            import_fail(ERROR_MISSING, file_, name + " is missing");
        }
        const import_storage_entry &entry = entries_.at(name);
        bool right = entry.kind == kind && entry.numbers.size() == count;
        for (const double value : entry.numbers) {
            right = right && std::isfinite(value);
        }
        if (!right) {
            import_fail(ERROR_SYNTAX, file_,
                        name + ": must be " + std::to_string(count) +
                            (count == 1 ? " finite number" : " finite numbers"));
        }
        return entry.numbers;
    }

    const import_file &file_;
    std::map<std::string, import_storage_entry> entries_;
};

/// The size of both cameras' pictures.
void read_size(const import_file &file, const settings &from, const std::string &width,
               const std::string &height, calibration *value) {
    const double size[2] = {from.number(width), from.number(height)};
    for (const double side : size) {
        if (side != std::floor(side) || side < 1 || side > LENS_SIDE_MAX_PX) {
            import_fail(ERROR_RANGE, file, width + ", " + height + ": must be whole numbers");
        }
    }
    for (lens *camera : {&value->left, &value->right}) {
        camera->width_px = int(size[0]);
        camera->height_px = int(size[1]);
    }
}

/// Camera.type: the equidistant lenses are KannalaBrandt8; other wide ones are not supported.
bool is_equidistant(const import_file &file) {
    return file.text.find("KannalaBrandt8") != std::string::npos;
}

void check_type(const import_file &file) {
    const std::string key = "Camera.type:";
    const size_t at = file.text.find(key);
    if (at == std::string::npos) {
        return;
    }
    const std::string rest = file.text.substr(at + key.size(), 32);
    for (const char *const known : {"PinHole", "Rectified", "KannalaBrandt8"}) {
        if (rest.find(known) != std::string::npos) {
            return;
        }
    }
    import_fail(ERROR_DISTORTION, file,
                "Camera.type: only PinHole, Rectified and KannalaBrandt8 are supported");
}

lens read_lens(const import_file &file, const settings &from, const std::string &prefix) {
    const auto named = [&](const char *name) { return prefix + "." + name; };
    lens camera{};
    import_camera_matrix(file, prefix,
                         {from.number(named("fx")), 0, from.number(named("cx")), 0,
                          from.number(named("fy")), from.number(named("cy")), 0, 0, 1},
                         &camera);
    const auto term = [&](const char *name) { return from.number_or_zero(named(name)); };
    if (is_equidistant(file)) {
        import_equidistant(file, prefix, {term("k1"), term("k2"), term("k3"), term("k4")}, &camera);
    } else {
        import_distortion(file, prefix,
                          {term("k1"), term("k2"), term("p1"), term("p2"), term("k3"), term("k4"),
                           term("k5"), term("k6")},
                          &camera);
    }
    return camera;
}

/// LEFT.* and RIGHT.*: what stereoRectify made of the raw cameras.
void read_sides(const import_file &file, const settings &from, const import_options &options,
                double unit_mm, import_pair *pair) {
    const std::vector<double> P[2] = {from.matrix("LEFT.P", 12), from.matrix("RIGHT.P", 12)};
    read_size(file, from, "LEFT.width", "LEFT.height", &pair->value);
    if (options.rectified) {
        import_projections(file, "LEFT.P and RIGHT.P", P[0], P[1], unit_mm, pair);
        pair->assumed.push_back("images are the rectified ones");
        return;
    }
    const std::vector<double> R[2] = {from.matrix("LEFT.R", 9), from.matrix("RIGHT.R", 9)};
    for (const std::string side : {"LEFT", "RIGHT"}) {
        lens *const camera = side == "LEFT" ? &pair->value.left : &pair->value.right;
        import_camera_matrix(file, side + ".K", from.matrix(side + ".K", 9), camera);
        if (is_equidistant(file)) {
            import_equidistant(file, side + ".D", from.row(side + ".D"), camera);
        } else {
            import_distortion(file, side + ".D", from.row(side + ".D"), camera);
        }
    }
    import_rectification(file, {"LEFT.R", "RIGHT.P"}, {R[0], P[0]}, {R[1], P[1]}, unit_mm,
                         &pair->value);
    pair->assumed.push_back("images are the raw ones (LEFT.K, RIGHT.K), not the rectified ones");
}

/// One camera for both pictures and a baseline.
void read_rectified(const import_file &file, const settings &from, const std::string &prefix,
                    double baseline_mm, import_pair *pair) {
    pair->value.left = pair->value.right = read_lens(file, from, prefix);
    if (!lens_is_ideal(&pair->value.left)) {
        import_fail(ERROR_DISTORTION, file,
                    prefix +
                        ": a distorted camera with a baseline and no second camera is one with "
                        "a depth sensor, or not rectified: a pair needs LEFT.K and RIGHT.K, or "
                        "Camera2.fx and Stereo.T_c1_c2");
    }
    if (!(baseline_mm > 0)) {
        import_fail(ERROR_BASELINE, file, "the baseline (Camera.bf, Stereo.b) must be above 0");
    }
    pair->value.rectified = true;
    pair->value.translation_right_left_mm[0] = -baseline_mm;
    pair->assumed.push_back("images are the rectified ones, and both cameras have the same matrix");
}

void read_pose(const import_file &file, const settings &from, double unit_mm, import_pair *pair) {
    const std::string name = from.has("Tlr") ? "Tlr" : "Stereo.T_c1_c2";
    const std::vector<double> values = from.matrix(name, name == "Tlr" ? 12 : 16);
    const import_matrix4 left = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    import_matrix4 right = left;
    std::copy(values.begin(), values.begin() + 12, right.begin());
    import_common_pose(file, name, left, right, false, unit_mm, &pair->value);
}

}  // namespace

bool import_orbslam_matches(const std::string &text) {
    for (const char *name : {"\nCamera.fx", "\nCamera1.fx", "\nLEFT.K"}) {
        if (text.find(name) != std::string::npos) {
            return true;
        }
    }
    return false;
}

import_pair import_orbslam(const import_file &file, const import_options &options) {
    check_type(file);
    import_pair pair;
    pair.format = "ORB-SLAM";
    pair.tag = "orbslam";
    const settings from(file);
    const double unit_mm = import_unit_mm(options, metre_mm, &pair);
    if (from.has("LEFT.K")) {
        read_sides(file, from, options, unit_mm, &pair);
        return pair;
    }
    const std::string first = from.has("Camera1.fx") ? "Camera1" : "Camera";
    if (from.has("Camera2.fx") && (from.has("Tlr") || from.has("Stereo.T_c1_c2"))) {
        pair.value.left = read_lens(file, from, first);
        pair.value.right = read_lens(file, from, "Camera2");
        read_pose(file, from, unit_mm, &pair);
    } else if (from.has("Stereo.b") || from.has("Camera.bf")) {
        const double baseline = from.has("Stereo.b")
                                    ? from.number("Stereo.b")
                                    : from.number("Camera.bf") / from.number(first + ".fx");
        read_rectified(file, from, first, baseline * unit_mm, &pair);
    } else {
        import_fail(
            ERROR_MISSING, file,
            "is one camera of ORB-SLAM: a pair has Camera.bf or Stereo.b, or Camera2.fx and "
            "Stereo.T_c1_c2");
    }
    read_size(file, from, "Camera.width", "Camera.height", &pair.value);
    return pair;
}

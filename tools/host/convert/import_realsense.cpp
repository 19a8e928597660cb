// SPDX-License-Identifier: Apache-2.0
/// Two files that users of a RealSense D400 have. Both describe the infrared pair as the camera
/// sends it, rectified:
/// - the calibration table, as realsense-viewer saves it: one JSON object with the names baseline
/// (mm,
///   negative) and rectified.N.width, height, fx, fy, ppx, ppy for each size of the images;
/// - what `rs-enumerate-devices -c` prints: intrinsics of "Infrared 1" and "Infrared 2" for each
/// size,
///   and extrinsics between them in m.
/// Source: librealsense, common/calibration-model.cpp, tools/enumerate-devices.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "tools/host/convert/import.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

using json = nlohmann::ordered_json;

const char *const first_stream = "\"Infrared 1\"", *const second_stream = "\"Infrared 2\"";

/// Width, height, and fx fy cx cy of both cameras (px).
struct mode {
    double width_px = 0, height_px = 0;
    std::vector<double> camera[2];
};

std::string size_text(double width_px, double height_px) {
    return number_text(width_px, 6) + "x" + number_text(height_px, 6);
}

/// A number, or its text, as some programs write it.
double number(const import_file &file, const json &root, const std::string &name) {
    const auto found = root.find(name);
    if (found == root.end()) {
        import_fail(ERROR_MISSING, file, name + " is missing");
    }
    if (found->is_number() && std::isfinite(found->get<double>())) {
        return found->get<double>();
    }
    return import_numbers(file, name, found->is_string() ? found->get<std::string>() : "?", 1)[0];
}

std::vector<mode> table_modes(const import_file &file, const json &root) {
    std::vector<mode> modes;
    for (int i = 0; root.contains("rectified." + std::to_string(i) + ".width"); i++) {
        const std::string prefix = "rectified." + std::to_string(i) + ".";
        mode one;
        one.width_px = number(file, root, prefix + "width");
        one.height_px = number(file, root, prefix + "height");
        for (const char *name : {"fx", "fy", "ppx", "ppy"}) {
            one.camera[0].push_back(number(file, root, prefix + name));
        }
        one.camera[1] = one.camera[0];
        // Sizes that the camera does not have are zeros.
        if (one.width_px > 0 && one.height_px > 0 && one.camera[0][0] > 1) {
            modes.push_back(one);
        }
    }
    return modes;
}

/// The mode of the images' size.
mode mode_of(const import_file &file, const std::vector<mode> &modes,
             const import_options &options) {
    std::string sizes;
    for (const mode &one : modes) {
        if (one.width_px == options.width_px && one.height_px == options.height_px) {
            return one;
        }
        sizes += (sizes.empty() ? "" : ", ") + size_text(one.width_px, one.height_px);
    }
    if (modes.empty()) {
        import_fail(ERROR_MISSING, file, "contains no rectified pair of infrared images");
    }
    if (options.width_px <= 0) {
        import_fail(
            ERROR_MISSING, file,
            "has cameras for several image sizes: give one, --size WIDTHxHEIGHT (" + sizes + ")");
    }
    import_fail(ERROR_MISSING, file,
                "has no camera for images of " + size_text(options.width_px, options.height_px) +
                    " (only " + sizes + ")");
}

void set_cameras(const import_file &file, const mode &one, import_pair *pair) {
    lens *const lenses[2] = {&pair->value.left, &pair->value.right};
    for (int side = 0; side < 2; side++) {
        const std::vector<double> &c = one.camera[side];
        import_camera_matrix(file, size_text(one.width_px, one.height_px),
                             {c[0], 0, c[2], 0, c[1], c[3], 0, 0, 1}, lenses[side]);
        lenses[side]->width_px = static_cast<int>(one.width_px);
        lenses[side]->height_px = static_cast<int>(one.height_px);
    }
    pair->value.rectified = true;
    pair->assumed.push_back("images are the infrared pair, which the camera has rectified");
}

import_pair import_table(const import_file &file, const import_options &options) {
    import_pair pair;
    const json root = import_json(file);
    set_cameras(file, mode_of(file, table_modes(file, root), options), &pair);
    pair.value.translation_right_left_mm[0] =
        -std::fabs(number(file, root, "baseline")) * import_unit_mm(options, 1, &pair);
    return pair;
}

// The listing.

/// The words of a line, separated by blanks, of which names may have some.
std::string after(const std::string &line, const std::string &label) {
    const size_t at = line.find(label);
    return at == std::string::npos ? "" : line.substr(at + label.size());
}

/// Reads the block below the head of an intrinsic: LABEL VALUE in each line.
bool read_block(const import_file &file, const std::vector<import_line> &lines, size_t first,
                mode *one, int side) {
    static const char *const labels[] = {"Width:", "Height:", "Fx:", "Fy:", "PPX:", "PPY:"};
    std::map<std::string, double> values;
    for (size_t i = first; i < lines.size() && i < first + 8; i++) {
        for (const char *label : labels) {
            const std::string text = after(lines[i].text, label);
            if (!text.empty()) {
                values[label] =
                    import_numbers(file, "line " + std::to_string(lines[i].number), text, 1)[0];
            }
        }
        const std::string bent = after(lines[i].text, "Coeffs:");
        if (!bent.empty() && bent.find_first_of("123456789") != std::string::npos) {
            return false;  // not rectified
        }
    }
    if (values.size() != 6) {
        return false;
    }
    one->width_px = values["Width:"];
    one->height_px = values["Height:"];
    one->camera[side] = {values["Fx:"], values["Fy:"], values["PPX:"], values["PPY:"]};
    return true;
}

std::vector<mode> listed_modes(const import_file &file, const std::vector<import_line> &lines) {
    std::map<std::pair<double, double>, mode> modes;
    for (size_t i = 0; i < lines.size(); i++) {
        if (lines[i].text.find(" Intrinsic of ") != 0) {
            continue;
        }
        for (int side = 0; side < 2; side++) {
            const bool named =
                lines[i].text.find(side == 0 ? first_stream : second_stream) != std::string::npos;
            // 16 bits per pixel are the raw images.
            const bool raw = lines[i].text.find("{Y16}") != std::string::npos;
            mode one;
            if (named && !raw && read_block(file, lines, i + 1, &one, side)) {
                mode &kept = modes[{one.width_px, one.height_px}];
                kept.width_px = one.width_px;
                kept.height_px = one.height_px;
                kept.camera[side] = one.camera[side];
            }
        }
    }
    std::vector<mode> both;
    for (const auto &item : modes) {
        if (!item.second.camera[0].empty() && !item.second.camera[1].empty()) {
            both.push_back(item.second);
        }
    }
    return both;
}

/// The translation from the first to the second camera, in m.
std::vector<double> listed_translation(const import_file &file,
                                       const std::vector<import_line> &lines) {
    for (size_t i = 0; i < lines.size(); i++) {
        const std::string &text = lines[i].text;
        const size_t from = text.find(std::string("Extrinsic from ") + first_stream);
        if (from == std::string::npos || text.find(second_stream) == std::string::npos) {
            continue;
        }
        for (size_t j = i + 1; j < lines.size() && j < i + 10; j++) {
            const std::string values = after(lines[j].text, "Translation Vector:");
            if (!values.empty()) {
                return import_numbers(file, "line " + std::to_string(lines[j].number), values, 3);
            }
        }
    }
    import_fail(ERROR_MISSING, file,
                "the extrinsic from \"Infrared 1\" to \"Infrared 2\" is missing");
}

import_pair import_listing(const import_file &file, const import_options &options) {
    import_pair pair;
    const std::vector<import_line> lines = import_lines(file.text);
    const mode one = mode_of(file, listed_modes(file, lines), options);
    const double unit_mm = import_unit_mm(options, metre_mm, &pair);
    set_cameras(file, one, &pair);
    pair.value.translation_right_left_mm[0] = listed_translation(file, lines)[0] * unit_mm;
    return pair;
}

bool is_listing(const std::string &text) {
    return text.find("Intrinsic of \"Infrared") != std::string::npos;
}

}  // namespace

bool import_realsense_matches(const std::string &text) {
    return is_listing(text) || text.find("\"rectified.0.fx\"") != std::string::npos;
}

import_pair import_realsense(const import_file &file, const import_options &options) {
    import_pair pair =
        is_listing(file.text) ? import_listing(file, options) : import_table(file, options);
    pair.format = "RealSense";
    pair.tag = "realsense";
    return pair;
}

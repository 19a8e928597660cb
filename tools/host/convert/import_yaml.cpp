// SPDX-License-Identifier: Apache-2.0
#include "tools/host/convert/import_yaml.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.h"

YAML::Node import_yaml_map(const import_file &file, const std::string &text,
                           const std::string &what) {
    try {
        // YAML parsers reject OpenCV's first line; a comment keeps the line numbers.
        const bool opencv = text.compare(0, 5, "%YAML") == 0;
        const YAML::Node root = YAML::Load(opencv ? "#" + text.substr(1) : text);
        if (!root.IsMap()) {
            import_fail(ERROR_SYNTAX, file, "must be " + what);
        }
        return root;
    } catch (const YAML::Exception &error) {
        import_fail(
            ERROR_SYNTAX, file,
            "line " + std::to_string(error.mark.line + 1) + ": is not " + what + ": " + error.msg);
    }
}

std::string import_yaml_word(const YAML::Node &node) {
    return node && node.IsScalar() ? node.Scalar() : "";
}

std::vector<double> import_yaml_numbers(const import_file &file, const std::string &field,
                                        const YAML::Node &node) {
    if (!node) {
        import_fail(ERROR_MISSING, file, field + " is missing");
    }
    if (node.IsScalar()) {
        return import_numbers(file, field, node.Scalar(), 1);
    }
    if (!node.IsSequence()) {
        import_fail(ERROR_SYNTAX, file, field + ": must be a list of numbers");
    }
    std::string text;
    for (const YAML::Node &value : node) {
        text += (value.IsScalar() ? value.Scalar() : std::string("?")) + " ";
    }
    return import_numbers(file, field, text, node.size());
}

std::vector<double> import_yaml_numbers(const import_file &file, const std::string &field,
                                        const YAML::Node &node, size_t count) {
    const std::vector<double> values = import_yaml_numbers(file, field, node);
    if (values.size() != count) {
        import_fail(ERROR_SYNTAX, file,
                    field + ": has " + std::to_string(values.size()) + " numbers instead of " +
                        std::to_string(count));
    }
    return values;
}

import_matrix4 import_yaml_pose(const import_file &file, const std::string &field,
                                const YAML::Node &node) {
    const YAML::Node list = node && node.IsMap() ? node["data"] : node;
    if (!list) {
        import_fail(ERROR_MISSING, file, field + " is missing");
    }
    std::vector<double> all;
    const bool rows = list.IsSequence() && list.size() == 4;
    if (rows) {
        for (const YAML::Node &row : list) {
            const std::vector<double> values = import_yaml_numbers(file, field, row, 4);
            all.insert(all.end(), values.begin(), values.end());
        }
    } else {
        all = import_yaml_numbers(file, field, list, 16);
    }
    import_matrix4 pose;
    std::copy(all.begin(), all.end(), pose.begin());
    return pose;
}

lens import_yaml_lens(const import_file &file, const std::string &field,
                      const std::vector<double> &intrinsics, const std::vector<double> &size_px,
                      const std::vector<double> &D) {
    lens camera{};
    for (const double side_px : size_px) {
        if (side_px != std::floor(side_px) || side_px < 1 || side_px > LENS_SIDE_MAX_PX) {
            import_fail(ERROR_RANGE, file,
                        field + ": the image size must be two integers from 1 to " +
                            std::to_string(LENS_SIDE_MAX_PX));
        }
    }
    camera.width_px = static_cast<int>(size_px[0]);
    camera.height_px = static_cast<int>(size_px[1]);
    import_camera_matrix(
        file, field, {intrinsics[0], 0, intrinsics[2], 0, intrinsics[1], intrinsics[3], 0, 0, 1},
        &camera);
    import_distortion(file, field, D, &camera);
    return camera;
}

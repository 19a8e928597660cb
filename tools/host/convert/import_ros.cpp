// SPDX-License-Identifier: Apache-2.0
/// sensor_msgs/CameraInfo as YAML, as written by camera_calibration (camera_matrix: {data}) or as
/// an echoed message (K: [...] or k: [...]), or with the same names as OpenCV writes them. For a
/// point of the rectified frame P = [f 0 cx Tx; 0 f cy Ty; 0 0 1 0] with Tx = -f B in the right
/// camera, lengths in m, and R maps the raw camera's frame to the rectified one. Source: REP 104,
/// CameraInfo.msg.
#include "core/error.h"
#include "tools/host/convert/import_yaml.hpp"

namespace {

struct camera_info {
    lens camera{};
    std::vector<double> D, R, P;
    bool ideal;  // no distortion, R is the identity, P holds the same camera as K
};

YAML::Node child(const YAML::Node &root, std::initializer_list<const char *> names) {
    for (const char *name : names) {
        const YAML::Node node = root[name];
        if (node) {
            return node;
        }
    }
    return YAML::Node(YAML::NodeType::Undefined);
}

std::vector<double> numbers(const import_file &file, const YAML::Node &root,
                            std::initializer_list<const char *> names) {
    const std::string field = *names.begin();
    YAML::Node node = child(root, names);
    if (!node) {
        import_fail(ERROR_MISSING, file, field + " is missing");
    }
    if (node.IsMap()) {
        node = node["data"];
    }
    if (!node || !node.IsSequence()) {
        import_fail(ERROR_SYNTAX, file, field + ": must be a list of numbers");
    }
    return import_yaml_numbers(file, field, node);
}

std::vector<double> matrix(const import_file &file, const YAML::Node &root,
                           std::initializer_list<const char *> names, size_t count) {
    const std::vector<double> values = numbers(file, root, names);
    if (values.size() != count) {
        import_fail(ERROR_SYNTAX, file,
                    std::string(*names.begin()) + ": has " + std::to_string(values.size()) +
                        " numbers instead of " + std::to_string(count));
    }
    return values;
}

int whole(const import_file &file, const YAML::Node &root,
          std::initializer_list<const char *> names, int missing) {
    const YAML::Node node = child(root, names);
    if (!node) {
        if (missing < 0) {
            import_fail(ERROR_MISSING, file, std::string(*names.begin()) + " is missing");
        }
        return missing;
    }
    int value = 0;
    if (!node.IsScalar() || !YAML::convert<int>::decode(node, value)) {
        import_fail(ERROR_SYNTAX, file, std::string(*names.begin()) + ": must be an integer");
    }
    return value;
}

void refuse_binning(const import_file &file, const YAML::Node &root) {
    if (whole(file, root, {"binning_x"}, 0) > 1 || whole(file, root, {"binning_y"}, 0) > 1) {
        import_fail(ERROR_RANGE, file, "binning_x, binning_y: binned images are not supported");
    }
    const YAML::Node roi = root["roi"];
    if (roi && roi.IsMap() &&
        (whole(file, roi, {"x_offset"}, 0) != 0 || whole(file, roi, {"y_offset"}, 0) != 0)) {
        import_fail(ERROR_RANGE, file, "roi: images of a region are not supported");
    }
}

/// The lens by the name of its distortion model.
void read_distortion(const import_file &file, const YAML::Node &root, camera_info *info) {
    static const char *const field = "distortion_coefficients";
    const YAML::Node node = child(root, {"distortion_model"});
    const std::string model = node && node.IsScalar() ? node.Scalar() : "";
    if (model == "equidistant" || model == "fisheye" || model == "kannala_brandt4") {
        import_equidistant(file, field, info->D, &info->camera);
        return;
    }
    const bool named = model == "plumb_bob" || model == "rational_polynomial";
    if (!named && !(model.empty() && info->D.empty())) {
        import_fail(ERROR_DISTORTION, file,
                    "distortion_model " + (model.empty() ? "is missing" : model) +
                        ": only plumb_bob, rational_polynomial and equidistant are supported: "
                        "calibrate the camera with one of them");
    }
    import_distortion(file, field, info->D, &info->camera);
}

camera_info read_info(const import_file &file) {
    const YAML::Node root =
        import_yaml_map(file, file.text, "a YAML map, as camera_info files are");
    camera_info info;
    info.camera.width_px = whole(file, root, {"image_width", "width"}, -1);
    info.camera.height_px = whole(file, root, {"image_height", "height"}, -1);
    refuse_binning(file, root);
    const std::vector<double> K = matrix(file, root, {"camera_matrix", "K", "k"}, 9);
    import_camera_matrix(file, "camera_matrix", K, &info.camera);
    info.D = numbers(file, root, {"distortion_coefficients", "D", "d"});
    read_distortion(file, root, &info);
    info.R = matrix(file, root, {"rectification_matrix", "R", "r"}, 9);
    info.P = matrix(file, root, {"projection_matrix", "P", "p"}, 12);
    const std::vector<double> &P = info.P;
    info.ideal = lens_is_ideal(&info.camera) &&
                 info.R == std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1} &&
                 K == std::vector<double>{P[0], P[1], P[2], P[4], P[5], P[6], P[8], P[9], P[10]};
    return info;
}

}  // namespace

bool import_ros_matches(const std::string &text) {
    // Files that OpenCV wrote have these names too, for one camera.
    const bool camera = text.find("\nprojection_matrix:") != std::string::npos;
    return camera || (text.find("opencv-matrix") == std::string::npos &&
                      text.find("distortion_model:") != std::string::npos);
}

import_pair import_ros(const std::vector<import_file> &files, const import_options &options) {
    import_pair pair;
    pair.format = "ROS camera_info";
    pair.tag = "ros";
    const double unit_mm = import_unit_mm(options, metre_mm, &pair);
    const import_file *reading = &files[0];
    try {
        const camera_info left = read_info(files[0]);
        reading = &files[1];
        const camera_info right = read_info(files[1]);
        if (options.rectified || (left.ideal && right.ideal && left.P[0] == right.P[0])) {
            import_projections(files[1], "projection_matrix", left.P, right.P, unit_mm, &pair);
            pair.assumed.push_back("images assumed to be rectified (image_rect)");
        } else {
            pair.value.left = left.camera;
            pair.value.right = right.camera;
            import_rectification(files[1], {"rectification_matrix", "projection_matrix"},
                                 {left.R, left.P}, {right.R, right.P}, unit_mm, &pair.value);
            pair.assumed.push_back("images assumed to be raw (image_raw)");
        }
        pair.value.left.width_px = left.camera.width_px;
        pair.value.left.height_px = left.camera.height_px;
        pair.value.right.width_px = right.camera.width_px;
        pair.value.right.height_px = right.camera.height_px;
    } catch (const YAML::Exception &error) {
        import_fail(ERROR_SYNTAX, *reading,
                    "line " + std::to_string(error.mark.line + 1) + ": not YAML: " + error.msg);
    }
    return pair;
}

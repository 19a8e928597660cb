// SPDX-License-Identifier: Apache-2.0
/// Kalibr's camera chain. cam0 is the left camera; cam1's T_cn_cnm1 maps points of cam0 into its
/// frame, in m. With an inertial unit both have T_cam_imu; OpenVINS writes its inverse, T_imu_cam,
/// and OpenCV's first line above it. Source: Kalibr wiki, "Yaml formats" and "Supported models".
#include "core/error.h"
#include "tools/host/convert/import_yaml.hpp"

namespace {

lens read_camera(const import_file &file, const std::string &name, const YAML::Node &node) {
    if (!node || !node.IsMap()) {
        import_fail(ERROR_MISSING, file, name + " is missing: a pair is cam0 and cam1");
    }
    const std::string model = import_yaml_word(node["camera_model"]),
                      bent = import_yaml_word(node["distortion_model"]);
    if (model != "pinhole") {
        import_fail(ERROR_DISTORTION, file,
                    name + ", camera_model " + (model.empty() ? "is missing" : model) +
                        ": only pinhole is supported: calibrate with pinhole-radtan or "
                        "pinhole-equi");
    }
    if (bent != "radtan" && bent != "equi" && bent != "none") {
        import_fail(ERROR_DISTORTION, file,
                    name + ", distortion_model " + (bent.empty() ? "is missing" : bent) +
                        ": only radtan, equi and none are supported: calibrate with "
                        "pinhole-radtan or pinhole-equi");
    }
    const auto numbers = [&](const char *field, size_t count) {
        return import_yaml_numbers(file, name + ", " + field, node[field], count);
    };
    const std::vector<double> D =
        bent == "none" ? std::vector<double>{} : numbers("distortion_coeffs", 4);
    lens camera = import_yaml_lens(file, name, numbers("intrinsics", 4), numbers("resolution", 2),
                                   bent == "equi" ? std::vector<double>{} : D);
    if (bent == "equi") {
        import_equidistant(file, name + ", distortion_coeffs", D, &camera);
    }
    return camera;
}

/// The pose of cam1 by the first of the known fields.
void read_pose(const import_file &file, const YAML::Node &left, const YAML::Node &right,
               double unit_mm, calibration *value) {
    const import_matrix4 identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const auto pose = [&](const std::string &camera, const YAML::Node &node, const char *name) {
        return import_yaml_pose(file, camera + ", " + name, node[name]);
    };
    for (const char *name : {"T_cam_imu", "T_imu_cam"}) {
        if (!right["T_cn_cnm1"] && left[name] && right[name]) {
            import_common_pose(file, name, pose("cam0", left, name), pose("cam1", right, name),
                               std::string(name) == "T_cam_imu", unit_mm, value);
            return;
        }
    }
    import_common_pose(file, "cam1, T_cn_cnm1", identity, pose("cam1", right, "T_cn_cnm1"), true,
                       unit_mm, value);
}

}  // namespace

bool import_kalibr_matches(const std::string &text) {
    return text.compare(0, 5, "cam0:") == 0 || text.find("\ncam0:") != std::string::npos;
}

import_pair import_kalibr(const import_file &file, const import_options &options) {
    import_pair pair;
    pair.format = "Kalibr";
    pair.tag = "kalibr";
    const YAML::Node root = import_yaml_map(file, file.text, "a camera chain of Kalibr");
    pair.value.left = read_camera(file, "cam0", root["cam0"]);
    pair.value.right = read_camera(file, "cam1", root["cam1"]);
    read_pose(file, root["cam0"], root["cam1"], import_unit_mm(options, metre_mm, &pair),
              &pair.value);
    if (root["cam2"]) {
        pair.assumed.push_back("the pair is cam0 and cam1 of a longer chain");
    }
    return pair;
}

// SPDX-License-Identifier: Apache-2.0
/// Kalibr's camera chain. cam0 is the left camera; cam1's T_cn_cnm1 maps points of cam0 into its
/// frame, in m. Source: Kalibr wiki, "Yaml formats" and "Supported models".
#include <cmath>

#include "core/error.h"
#include "tools/host/convert/import_yaml.hpp"

namespace {

const double metre_mm = 1000;

std::string word(const YAML::Node &node) {
    return node && node.IsScalar() ? node.Scalar() : "";
}

lens read_camera(const import_file &file, const std::string &name, const YAML::Node &node,
                 std::vector<std::string> *assumed) {
    if (!node || !node.IsMap()) {
        import_fail(ERROR_MISSING, file, name + " is missing: a pair is cam0 and cam1");
    }
    const std::string model = word(node["camera_model"]), bent = word(node["distortion_model"]);
    if (model != "pinhole") {
        import_fail(ERROR_DISTORTION, file,
                    name + ", camera_model " + (model.empty() ? "is missing" : model) +
                        ": only pinhole is supported: calibrate with pinhole-radtan");
    }
    if (bent != "radtan" && bent != "none") {
        import_fail(ERROR_DISTORTION, file,
                    name + ", distortion_model " + (bent.empty() ? "is missing" : bent) +
                        ": only radtan and none are supported: calibrate with pinhole-radtan");
    }
    const auto numbers = [&](const char *field, size_t count) {
        return import_yaml_numbers(file, name + ", " + field, node[field], count);
    };
    return import_yaml_lens(
        file, name, numbers("intrinsics", 4), numbers("resolution", 2),
        bent == "none" ? std::vector<double>{} : numbers("distortion_coeffs", 4), assumed);
}

}  // namespace

bool import_kalibr_matches(const std::string &text) {
    return text.compare(0, 5, "cam0:") == 0 || text.find("\ncam0:") != std::string::npos;
}

import_pair import_kalibr(const import_file &file, const import_options &) {
    import_pair pair;
    pair.format = "Kalibr";
    pair.tag = "kalibr";
    const YAML::Node root = import_yaml_map(file, file.text, "a camera chain of Kalibr");
    pair.value.left = read_camera(file, "cam0", root["cam0"], &pair.assumed);
    pair.value.right = read_camera(file, "cam1", root["cam1"], &pair.assumed);
    const std::string field = "cam1, T_cn_cnm1";
    const YAML::Node pose = root["cam1"]["T_cn_cnm1"];
    if (!pose || !pose.IsSequence() || pose.size() != 4) {
        import_fail(ERROR_MISSING, file, field + ": must be a matrix of four rows");
    }
    std::vector<double> R;
    double t_mm[3];
    for (size_t row = 0; row < 3; row++) {
        const std::vector<double> values = import_yaml_numbers(file, field, pose[row], 4);
        R.insert(R.end(), values.begin(), values.begin() + 3);
        t_mm[row] = values[3] * metre_mm;
    }
    import_pose(file, field, R, t_mm, &pair.value);
    if (root["cam2"]) {
        pair.assumed.push_back("the pair is cam0 and cam1 of a longer chain");
    }
    return pair;
}

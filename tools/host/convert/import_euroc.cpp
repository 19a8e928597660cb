// SPDX-License-Identifier: Apache-2.0
/// One sensor.yaml per camera (mav0/cam0, mav0/cam1) of data sets in EuRoC's form. T_BS maps points
/// of the sensor into the body's frame, in m. Source: Burri et al., "The EuRoC micro aerial vehicle
/// datasets", IJRR 2016; TUM VI has the same form with equidistant lenses.
#include "core/error.h"
#include "tools/host/convert/import_yaml.hpp"

namespace {

struct sensor {
    lens camera;
    import_matrix4 T_body_camera;
};

/// Rejects other sensors than pinhole cameras.
void check_sensor(const import_file &file, const YAML::Node &root) {
    const std::string type = import_yaml_word(root["sensor_type"]),
                      model = import_yaml_word(root["camera_model"]);
    if (!type.empty() && type != "camera") {
        import_fail(ERROR_SYNTAX, file, "sensor_type " + type + ": is not a camera");
    }
    if (!model.empty() && model != "pinhole") {
        import_fail(ERROR_DISTORTION, file,
                    "camera_model " + model + ": only pinhole is supported");
    }
}

bool is_radtan(const std::string &model) {
    return model == "radial-tangential" || model == "radtan" || model == "plumb_bob";
}

sensor read_sensor(const import_file &file) {
    const YAML::Node root = import_yaml_map(file, file.text, "a sensor.yaml of EuRoC");
    check_sensor(file, root);
    const std::string bent = import_yaml_word(root["distortion_model"]);
    const bool none = bent.empty() || bent == "none";
    const bool equidistant = bent == "equidistant" || bent == "equi";
    if (!none && !equidistant && !is_radtan(bent)) {
        import_fail(
            ERROR_DISTORTION, file,
            "distortion_model " + bent + ": only radial-tangential and equidistant are supported");
    }
    const auto numbers = [&](const char *field, size_t count) {
        return import_yaml_numbers(file, field, root[field], count);
    };
    const YAML::Node D = root["distortion_coefficients"];
    if (bent.empty() && D) {
        import_fail(ERROR_MISSING, file, "distortion_model is missing: is it radial-tangential?");
    }
    sensor result;
    const std::vector<double> coefficients =
        none ? std::vector<double>{} : import_yaml_numbers(file, "distortion_coefficients", D);
    result.camera =
        import_yaml_lens(file, "intrinsics", numbers("intrinsics", 4), numbers("resolution", 2),
                         equidistant ? std::vector<double>{} : coefficients);
    if (equidistant) {
        import_equidistant(file, "distortion_coefficients", coefficients, &result.camera);
    }
    result.T_body_camera = import_yaml_pose(file, "T_BS", root["T_BS"]);
    return result;
}

}  // namespace

bool import_euroc_matches(const std::string &text) {
    return text.compare(0, 5, "T_BS:") == 0 || text.find("\nT_BS:") != std::string::npos;
}

import_pair import_euroc(const std::vector<import_file> &files, const import_options &options) {
    import_pair pair;
    pair.format = "EuRoC";
    pair.tag = "euroc";
    const sensor left = read_sensor(files[0]);
    const sensor right = read_sensor(files[1]);
    pair.value.left = left.camera;
    pair.value.right = right.camera;
    import_common_pose(files[1], "T_BS (of it or its partner)", left.T_body_camera,
                       right.T_body_camera, false, import_unit_mm(options, metre_mm, &pair),
                       &pair.value);
    return pair;
}

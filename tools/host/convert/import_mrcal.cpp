// SPDX-License-Identifier: Apache-2.0
/// mrcal's .cameramodel, one file per camera: a Python dictionary, which is YAML except for the
/// bytes of its optimization inputs. `extrinsics` is rt_cam_ref in m, as in export_mrcal.cpp.
#include <cstdio>

#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/convert/import_yaml.hpp"

namespace {

struct mrcal_model {
    lens camera{};
    import_matrix4 T_cam_ref;
};

/// Without byte strings b'...', whose braces would confuse the parser.
std::string without_bytes(const std::string &text) {
    const std::string key = "'optimization_inputs':";
    const size_t at = text.find(key);
    const size_t begin = at == std::string::npos ? at : text.find("b'", at + key.size());
    const size_t end = begin == std::string::npos ? begin : text.find('\'', begin + 2);
    return end == std::string::npos ? text : text.substr(0, begin) + "0" + text.substr(end + 1);
}

mrcal_model read_model(const import_file &file) {
    const YAML::Node root = import_yaml_map(file, without_bytes(file.text), "a camera of mrcal");
    const YAML::Node named = root["lensmodel"];
    const std::string name = named && named.IsScalar() ? named.Scalar() : "";
    const std::string opencv = "LENSMODEL_OPENCV";
    size_t coefficients = 0;
    const bool known = name == "LENSMODEL_PINHOLE" ||
                       (name.compare(0, opencv.size(), opencv) == 0 &&
                        std::sscanf(name.c_str() + opencv.size(), "%2zu", &coefficients) == 1);
    if (!known) {
        import_fail(ERROR_DISTORTION, file,
                    "lensmodel " + (name.empty() ? "is missing" : name) +
                        ": only LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5 and 8 are supported: "
                        "convert with mrcal-convert-lensmodel");
    }
    const std::vector<double> intrinsics =
        import_yaml_numbers(file, "intrinsics", root["intrinsics"], 4 + coefficients);
    const std::vector<double> D(intrinsics.begin() + 4, intrinsics.end());
    mrcal_model result;
    result.camera =
        import_yaml_lens(file, "intrinsics", intrinsics,
                         import_yaml_numbers(file, "imagersize", root["imagersize"], 2), D);
    const std::vector<double> rt = import_yaml_numbers(file, "extrinsics", root["extrinsics"], 6);
    double R[9];
    geometry_rotation_from_vector(rt.data(), R);
    result.T_cam_ref = {R[0], R[1], R[2], rt[3], R[3], R[4], R[5], rt[4],
                        R[6], R[7], R[8], rt[5], 0,    0,    0,    1};
    return result;
}

}  // namespace

bool import_mrcal_matches(const std::string &text) {
    return text.find("'lensmodel'") != std::string::npos;
}

import_pair import_mrcal(const std::vector<import_file> &files, const import_options &options) {
    import_pair pair;
    pair.format = "mrcal";
    pair.tag = "mrcal";
    const mrcal_model left = read_model(files[0]);
    const mrcal_model right = read_model(files[1]);
    pair.value.left = left.camera;
    pair.value.right = right.camera;
    import_common_pose(files[1], "extrinsics", left.T_cam_ref, right.T_cam_ref, true,
                       import_unit_mm(options, metre_mm, &pair), &pair.value);
    return pair;
}

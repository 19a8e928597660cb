// SPDX-License-Identifier: Apache-2.0
/// The true cameras of the simulated rig, as its command `truth` and simrig-render write them: K
/// and the Brown-Conrady distortion in pixels of the whole sensor, the readout window, and the pose
/// T_world_camera. Nothing is fitted: the model is ours. The keys are described in
/// tools/simrig/README.md; no code is shared with that program.
#include <cmath>

#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/convert/import_yaml.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

struct true_camera {
    lens camera{};
    std::vector<double> R_world_camera, pupil_mm;
    std::vector<double> skip;
};

std::vector<double> numbers(const import_file &file, const YAML::Node &root, const char *name,
                            size_t count) {
    return import_yaml_numbers(file, name, root[name], count);
}

std::vector<double> whole_numbers(const import_file &file, const YAML::Node &root, const char *name,
                                  double min, double max) {
    const std::vector<double> values = numbers(file, root, name, 2);
    for (const double value : values) {
        if (value != std::floor(value) || value < min || value > max) {
            import_fail(ERROR_RANGE, file,
                        std::string(name) + ": must be two integers from " + number_text(min, 6) +
                            " to " + number_text(max, 6));
        }
    }
    return values;
}

/// An output pixel of the pair n (of columns or rows) is at first + skip 2 n, its neighbour of the
/// other colour 1 behind it, and a binned one bin - 1 farther. On the even grid closest to both,
/// each is off by half of skip - 1.
double first_centre(double first, double skip, double bin) {
    return first + (bin - 1) - (skip - 1) / 2;
}

true_camera read_camera(const import_file &file) {
    const YAML::Node root = YAML::Load(file.text);
    if (!root.IsMap()) {
        import_fail(ERROR_SYNTAX, file, "must be a YAML map, as the rig writes it");
    }
    const double side_px = LENS_SIDE_MAX_PX, thinned = 16;
    const auto size = whole_numbers(file, root, "size_px", 1, side_px);
    const auto first = whole_numbers(file, root, "first_px", -side_px, side_px);
    const auto skip = whole_numbers(file, root, "skip", 1, thinned);
    const auto bin = whole_numbers(file, root, "bin", 1, thinned);
    for (const double mirrored : whole_numbers(file, root, "mirrored", 0, 1)) {
        if (mirrored != 0) {
            import_fail(ERROR_RANGE, file, "mirrored: mirrored frames are not supported");
        }
    }
    const double focal_px = numbers(file, root, "focal_length_px", 1)[0];
    const auto centre_px = numbers(file, root, "centre_px", 2);
    const auto radial = numbers(file, root, "radial", 3);
    const auto decentring = numbers(file, root, "decentring", 2);
    true_camera result;
    lens &camera = result.camera;
    camera.width_px = static_cast<int>(size[0]);
    camera.height_px = static_cast<int>(size[1]);
    camera.fx_px = focal_px / skip[0];
    camera.fy_px = focal_px / skip[1];
    camera.cx_px = (centre_px[0] - first_centre(first[0], skip[0], bin[0])) / skip[0];
    camera.cy_px = (centre_px[1] - first_centre(first[1], skip[1], bin[1])) / skip[1];
    camera.k1 = radial[0];
    camera.k2 = radial[1];
    camera.k3 = radial[2];
    camera.p1 = decentring[0];
    camera.p2 = decentring[1];
    result.skip = skip;
    result.pupil_mm = numbers(file, root, "pupil_mm", 3);
    result.R_world_camera = numbers(file, root, "rotation_world_camera", 9);
    double checked[3];
    if (geometry_vector_from_rotation(result.R_world_camera.data(), checked) != ERROR_OK) {
        import_fail(ERROR_ROTATION, file, "rotation_world_camera is not a rotation");
    }
    return result;
}

void set_pose(const import_file &file, const true_camera &left, const true_camera &right,
              calibration *value) {
    const std::vector<double> &R = right.R_world_camera;
    const double R_right_world[9] = {R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]};
    std::vector<double> R_right_left(9);
    geometry_multiply(R_right_world, left.R_world_camera.data(), R_right_left.data());
    double offset_world_mm[3], t_mm[3];
    for (size_t i = 0; i < 3; i++) {
        offset_world_mm[i] = left.pupil_mm[i] - right.pupil_mm[i];
    }
    geometry_rotate(R_right_world, offset_world_mm, t_mm);
    import_pose(file, "rotation_world_camera", R_right_left, t_mm, value);
}

}  // namespace

bool import_simrig_matches(const std::string &text) {
    return text.find("rotation_world_camera:") != std::string::npos;
}

import_pair import_simrig(const std::vector<import_file> &files, const import_options &) {
    import_pair pair;
    pair.format = "simulated rig";
    pair.tag = "simrig";
    const import_file *reading = &files[0];
    try {
        const true_camera left = read_camera(files[0]);
        reading = &files[1];
        const true_camera right = read_camera(files[1]);
        pair.value.left = left.camera;
        pair.value.right = right.camera;
        set_pose(files[1], left, right, &pair.value);
        pair.assumed.push_back("the true cameras of a simulated rig");
        for (const double skip : {left.skip[0], left.skip[1], right.skip[0], right.skip[1]}) {
            if (skip > 1) {
                pair.assumed.push_back(
                    "pixels assumed evenly spaced, although the two of a colour pair are " +
                    number_text((skip - 1) / (2 * skip), 3) + " px off that");
                break;
            }
        }
    } catch (const YAML::Exception &error) {
        import_fail(ERROR_SYNTAX, *reading,
                    "line " + std::to_string(error.mark.line + 1) + ": not YAML: " + error.msg);
    }
    return pair;
}

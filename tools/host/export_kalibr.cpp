// SPDX-License-Identifier: Apache-2.0
/// Kalibr's camera chain. T_cn_cnm1 takes points of the camera before into this one's frame, in m;
/// "pinhole" holds fu fv pu pv and "radtan" k1 k2 r1 r2, which are OpenCV's k1 k2 p1 p2. Source:
/// Kalibr wiki, "Yaml formats" and "Supported models".
#include "core/error.h"
#include "core/geometry.h"
#include "tools/host/export.hpp"

namespace {

const double metre_mm = 1000;

std::string camera(int number, const lens &one, const std::string &pose) {
    const std::string other = number == 0 ? "1" : "0";
    return "cam" + std::to_string(number) + ":\n" + pose + "  cam_overlaps: [" + other +
           "]\n  camera_model: pinhole\n  distortion_coeffs: [" +
           export_numbers({one.k1, one.k2, one.p1, one.p2}) +
           "]\n  distortion_model: radtan\n  intrinsics: [" +
           export_numbers({one.fx_px, one.fy_px, one.cx_px, one.cy_px}) + "]\n  resolution: [" +
           std::to_string(one.width_px) + ", " + std::to_string(one.height_px) +
           "]\n  rostopic: /cam" + std::to_string(number) + "/image_raw\n";
}

}  // namespace

std::vector<export_file> export_kalibr(const calibration &value) {
    if (value.left.k3 != 0 || value.right.k3 != 0) {
        throw export_failure{ERROR_DISTORTION,
                             "Kalibr's radtan model has no k3: calibrate with k1 k2 p1 p2 alone"};
    }
    double R[9];
    geometry_rotation_from_vector(value.rotation_right_left_rad, R);
    const double *t_mm = value.translation_right_left_mm;
    std::string pose = "  T_cn_cnm1:\n";
    for (int row = 0; row < 3; row++) {
        const double *r = R + 3 * row;
        pose += "  - [" + export_numbers({r[0], r[1], r[2], t_mm[row] / metre_mm}) + "]\n";
    }
    pose += "  - [0.0, 0.0, 0.0, 1.0]\n";
    return {{"camchain.yaml", camera(0, value.left, "") + camera(1, value.right, pose)}};
}

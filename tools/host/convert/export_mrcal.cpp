// SPDX-License-Identifier: Apache-2.0
/// mrcal's text form of a camera. `extrinsics` is rt_cam_ref: rotation vector and translation that
/// map points of the reference frame, which is the left camera's, into the camera's; in m.
/// LENSMODEL_OPENCV4 has k1 k2 p1 p2, LENSMODEL_OPENCV5 also k3, LENSMODEL_OPENCV8 also k4 k5 k6;
/// none is equidistant. Source: mrcal manual, "Camera
/// model representation".
#include "core/error.h"
#include "tools/host/convert/export.hpp"
#include "tools/host/convert/import.hpp"

namespace {

std::string model(const lens &one, const std::vector<double> &rt_cam_ref) {
    std::vector<double> numbers = {one.fx_px, one.fy_px, one.cx_px, one.cy_px,
                                   one.k1,    one.k2,    one.p1,    one.p2};
    if (one.kind == LENS_EQUIDISTANT) {
        throw export_failure{ERROR_DISTORTION,
                             "mrcal has no equidistant lens: calibrate with --model rational"};
    }
    const bool rational = one.kind == LENS_RATIONAL;
    if (one.k3 != 0 || rational) {
        numbers.push_back(one.k3);
    }
    if (rational) {
        numbers.insert(numbers.end(), {one.k4, one.k5, one.k6});
    }
    return "# mrcal camera model\n{\n    'lensmodel': 'LENSMODEL_OPENCV" +
           std::to_string(numbers.size() - 4) +
           "',\n\n    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n"
           "    'intrinsics': [ " +
           export_numbers(numbers) +
           " ],\n\n    # extrinsics are rt_cam_ref, in m; ref is the left camera\n"
           "    'extrinsics': [ " +
           export_numbers(rt_cam_ref) + " ],\n\n    'imagersize': [ " +
           std::to_string(one.width_px) + ", " + std::to_string(one.height_px) + " ]\n}\n";
}

}  // namespace

std::vector<export_file> export_mrcal(const calibration &value) {
    const double *r_rad = value.rotation_right_left_rad;
    const double *t_mm = value.translation_right_left_mm;
    return {
        {"left.cameramodel", model(value.left, {0, 0, 0, 0, 0, 0})},
        {"right.cameramodel", model(value.right, {r_rad[0], r_rad[1], r_rad[2], t_mm[0] / metre_mm,
                                                  t_mm[1] / metre_mm, t_mm[2] / metre_mm})}};
}

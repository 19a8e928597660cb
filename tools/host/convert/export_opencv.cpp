// SPDX-License-Identifier: Apache-2.0
/// The two files of OpenCV's sample stereo_calib. point_right = R point_left + T; R1 and R2 turn
/// the cameras' frames into the rectified one; P1, P2 and Q are stereoRectify's. Lengths in mm.
/// "fisheye_model: 1" (as in OpenCV's sample camera_calibration) says that D1 and D2 are those of
/// cv::fisheye.
#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/convert/export.hpp"

namespace {

std::string matrix(const std::string &name, int rows, int columns,
                   const std::vector<double> &values) {
    return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
           "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data: [ " +
           export_numbers(values) + " ]\n";
}

// cv::fisheye saves its coefficients as a column.
std::string camera(const std::string &digit, const lens &one) {
    const std::vector<double> D = export_coefficients(one);
    return matrix("M" + digit, 3, 3, {one.fx_px, 0, one.cx_px, 0, one.fy_px, one.cy_px, 0, 0, 1}) +
           matrix("D" + digit, one.kind == LENS_EQUIDISTANT ? 4 : 1,
                  one.kind == LENS_EQUIDISTANT ? 1 : int(D.size()), D);
}

}  // namespace

std::vector<export_file> export_opencv(const calibration &value) {
    if (value.left.width_px != value.right.width_px ||
        value.left.height_px != value.right.height_px) {
        throw export_failure{ERROR_RANGE,
                             "OpenCV's files hold one image size, and the two cameras' differ"};
    }
    const bool fisheye = value.left.kind == LENS_EQUIDISTANT;
    if (fisheye != (value.right.kind == LENS_EQUIDISTANT)) {
        throw export_failure{
            ERROR_DISTORTION,
            "OpenCV has functions for two fisheye lenses or for none, and only one "
            "of these is equidistant"};
    }
    const export_rectified rectified = export_rectify_or_fail(value);
    double R[9], P1[12], P2[12];
    geometry_rotation_from_vector(value.rotation_right_left_rad, R);
    export_projections(rectified, 1, P1, P2);
    const double *t_mm = value.translation_right_left_mm;
    // (x, y, d, 1) -> homogeneous (X, Y, Z, W) in the left rectified frame, as rectify.h states it.
    const double B = rectified.baseline_mm, f = rectified.f_px;
    const double stretch = f / rectified.fy_px;  // 1 except for rectified input with fx != fy
    const std::vector<double> Q = {
        1, 0,       0,     -rectified.cx_left_px,
        0, stretch, 0,     -stretch * rectified.cy_px,
        0, 0,       0,     f,
        0, 0,       1 / B, -(rectified.cx_left_px - rectified.cx_right_px) / B};
    const std::string begin = "%YAML:1.0\n---\n";
    const std::string size = "image_width: " + std::to_string(value.left.width_px) +
                             "\nimage_height: " + std::to_string(value.left.height_px) + "\n" +
                             (fisheye ? "fisheye_model: 1\n" : "");
    return {{"intrinsics.yml", begin + size + camera("1", value.left) + camera("2", value.right)},
            {"extrinsics.yml",
             begin + matrix("R", 3, 3, {R, R + 9}) + matrix("T", 3, 1, {t_mm, t_mm + 3}) +
                 matrix("R1", 3, 3, {rectified.R_rect_left, rectified.R_rect_left + 9}) +
                 matrix("R2", 3, 3, {rectified.R_rect_right, rectified.R_rect_right + 9}) +
                 matrix("P1", 3, 4, {P1, P1 + 12}) + matrix("P2", 3, 4, {P2, P2 + 12}) +
                 matrix("Q", 4, 4, Q)}};
}

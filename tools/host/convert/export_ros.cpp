// SPDX-License-Identifier: Apache-2.0
/// camera_info files as camera_calibration writes them. rectification_matrix maps the camera's
/// frame to the rectified one, P[3] = -f B in m. Source: CameraInfo.msg; REP 104.
#include "tools/host/convert/export.hpp"
#include "tools/host/convert/import.hpp"

namespace {

std::string ros_matrix(const std::string &name, int rows, int columns,
                       const std::vector<double> &values) {
    return name + ":\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(columns) +
           "\n  data: [" + export_numbers(values) + "]\n";
}

std::string info(const std::string &name, const lens &one, const double R[9], const double P[12]) {
    const std::vector<double> D = export_coefficients(one);
    return "image_width: " + std::to_string(one.width_px) +
           "\nimage_height: " + std::to_string(one.height_px) + "\ncamera_name: " + name + "\n" +
           ros_matrix("camera_matrix", 3, 3,
                      {one.fx_px, 0, one.cx_px, 0, one.fy_px, one.cy_px, 0, 0, 1}) +
           "distortion_model: " + export_ros_model(one) + "\n" +
           ros_matrix("distortion_coefficients", 1, int(D.size()), D) +
           ros_matrix("rectification_matrix", 3, 3, {R, R + 9}) +
           ros_matrix("projection_matrix", 3, 4, {P, P + 12});
}

}  // namespace

const char *export_ros_model(const lens &one) {
    static const char *const models[LENS_KINDS] = {"plumb_bob", "rational_polynomial",
                                                   "equidistant"};
    return models[one.kind];
}

std::vector<export_file> export_ros(const calibration &value) {
    const export_rectified rectified = export_rectify_or_fail(value);
    double P_left[12], P_right[12];
    export_projections(rectified, metre_mm, P_left, P_right);
    // These files have no field for the baseline, so a comment states it.
    const std::string baseline =
        "# baseline: " + export_numbers({rectified.baseline_mm / metre_mm}) + " m\n";
    return {{"left.yaml", baseline + info("left", value.left, rectified.R_rect_left, P_left)},
            {"right.yaml", baseline + info("right", value.right, rectified.R_rect_right, P_right)}};
}

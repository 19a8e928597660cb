// SPDX-License-Identifier: Apache-2.0
/// Our calibration in the files of other programs. All of them, like ours, put pixel (0,0) at the
/// centre of the top left pixel; unit of length, names and direction of the pose differ and are
/// stated in each exporter.
#ifndef VERGENCE_TOOLS_HOST_CONVERT_EXPORT_HPP
#define VERGENCE_TOOLS_HOST_CONVERT_EXPORT_HPP

#include <string>
#include <vector>

#include "stereo/geometry/calibration.h"

/// One file of an export.
struct export_file {
    std::string name, text;
    std::string loss{};  // what the format cannot hold, and the resulting error; "": nothing
};

/// Rectified cameras of an export whose images keep the raw images' size, which ROS requires and
/// OpenCV's users expect. In the frame of rectify.h.
struct export_rectified {
    double R_rect_left[9], R_rect_right[9];  // row-major
    double f_px, fy_px;
    double cx_left_px, cx_right_px, cy_px;
    double baseline_mm;
};

/// The rotations are those of our own rectification; the focal length keeps all of the shared view
/// in the image. Where the working range of depths reaches infinity both cameras get the same cx,
/// so that disparity 0 is infinity; verged pairs keep their offset. `calibration` must be valid.
/// Returns 0, or the error of `rectify_plan_make` (a pair without a shared view).
int export_rectify(const calibration &value, export_rectified *result);

/// The names that `export_files` accepts, separated by blanks.
extern const char *const export_formats;

/// The files of a valid calibration in a format (one of `export_formats`). Returns 0, or a negative
/// error code with `message` saying in one line what the format cannot hold; `files` is then
/// untouched. An approximation is not an error: see `export_file::loss`.
int export_files(const calibration &value, const std::string &format,
                 std::vector<export_file> *files, std::string *message);

/// The same, written into a directory, which is created if missing: all files or none. Returns 0 or
/// a negative error code with `message` set; fills `paths`, and `loss` with what all files lost.
int export_write(const calibration &value, const std::string &format, const std::string &directory,
                 std::vector<std::string> *paths, std::string *loss, std::string *message);

/// Writes files as `export_write` does.
int export_write_files(const std::vector<export_file> &files, const std::string &directory,
                       std::vector<std::string> *paths, std::string *loss, std::string *message);

// The formats. Each returns its files or throws `export_failure`.

struct export_failure {
    int code;  // enum error_code
    std::string message;
};

/// stereo_calib's pair: intrinsics.yml (M1 D1 M2 D2) and extrinsics.yml (R T R1 R2 P1 P2 Q), in mm.
std::vector<export_file> export_opencv(const calibration &value);
/// sensor_msgs/CameraInfo as camera_calibration writes it: left.yaml and right.yaml, in m.
std::vector<export_file> export_ros(const calibration &value);
/// Kalibr's camchain.yaml, in m. Equidistant lenses are its "equi"; its "radtan" has only k1 k2
/// p1 p2, which approximate other lenses.
std::vector<export_file> export_kalibr(const calibration &value);
/// mrcal's left.cameramodel and right.cameramodel, in m.
std::vector<export_file> export_mrcal(const calibration &value);

// Shared by the exporters.

/// Distortion coefficients in OpenCV's order: k1 k2 p1 p2 k3, with k4 k5 k6 if rational; k1 k2 k3
/// k4 if equidistant.
std::vector<double> export_coefficients(const lens &one);

/// The name that ROS gives to the lens's distortion.
const char *export_ros_model(const lens &one);

/// "a, b, c", each so that reading returns the same double.
std::string export_numbers(const std::vector<double> &values);

/// `export_rectify`, or throws.
export_rectified export_rectify_or_fail(const calibration &value);

/// Projections of the rectified cameras (3x4, row-major) in units of `unit_mm`.
void export_projections(const export_rectified &rectified, double unit_mm, double P_left[12],
                        double P_right[12]);

#endif

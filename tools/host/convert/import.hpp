// SPDX-License-Identifier: Apache-2.0
/// Importers of other programs' calibration files and their shared functions. An importer fills an
/// `import_pair` or throws `import_failure`; calibration_file.hpp is the non-throwing interface.
#ifndef VERGENCE_TOOLS_HOST_CONVERT_IMPORT_HPP
#define VERGENCE_TOOLS_HOST_CONVERT_IMPORT_HPP

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "stereo/geometry/calibration.h"
#include "stereo/zoom/zoom_calibration.h"

constexpr double metre_mm = 1000;  // the unit of most formats, also of the exporters

/// One file in memory.
struct import_file {
    std::string path, text;
};

/// What the user states about a file that the file leaves open.
struct import_options {
    int width_px = 0, height_px = 0;  // raw images, 0: unknown; used where the file has no size
    std::string unit;                 // unit of the file: "mm", "cm" or "m"; "": not stated
    bool rectified = false;     // the images are already rectified: use the file's projections
    int first_camera = -1;      // KITTI: the left camera, 0 or 2; -1: 2 where the file has it
    bool accept_edits = false;  // our own text: a wrong checksum is corrected, not rejected
};

/// An imported pair before it is rounded and validated.
struct import_pair {
    calibration value{};
    std::string format;                // e.g. "OpenCV"
    std::string tag;                   // lower-case prefix of the id, e.g. "opencv"
    double format_unit_mm = 1;         // unit of length that the format prescribes; 0: none
    std::vector<std::string> assumed;  // sentences without a full stop, printable ASCII
};

/// Why a file was rejected; `message` is one line that names file and field and says what to do.
struct import_failure {
    int code;  // enum error_code
    std::string message;
};

/// Files of `stereo_calib`, or with the same or similar names, one or several: M1 D1 M2 D2 R T,
/// image size if stated; also arrays of these names that numpy saved (.npz). Sides of files with
/// one camera: in the order of `files`.
import_pair import_opencv(const std::vector<import_file> &files, const import_options &options);

/// The pair of camera_info files, left first.
import_pair import_ros(const std::vector<import_file> &files, const import_options &options);

/// The true cameras of the simulated rig, left first; `skip` is treated as smaller images.
import_pair import_simrig(const std::vector<import_file> &files, const import_options &options);

/// Kalibr's camera chain: cam0 is the left camera, cam1 the right one.
import_pair import_kalibr(const import_file &file, const import_options &options);

/// The pair of sensor.yaml files of a data set in EuRoC's form, left first.
import_pair import_euroc(const std::vector<import_file> &files, const import_options &options);

/// The settings of ORB-SLAM2 and 3 for a stereo camera.
import_pair import_orbslam(const import_file &file, const import_options &options);

/// The EEPROM of a camera of Luxonis, as DepthAI writes it.
import_pair import_depthai(const import_file &file, const import_options &options);

/// The rectified infrared pair of a RealSense D400: the calibration table that its viewer saves, or
/// what `rs-enumerate-devices -c` prints.
import_pair import_realsense(const import_file &file, const import_options &options);

/// K.txt: the nine numbers of the camera matrix of a rectified pair and its baseline.
import_pair import_matrix(const import_file &file, const import_options &options);

/// The pair of mrcal's camera models, left first.
import_pair import_mrcal(const std::vector<import_file> &files, const import_options &options);

/// Middlebury's calib.txt (2014 and later).
import_pair import_middlebury(const import_file &file, const import_options &options);

/// KITTI's calib_cam_to_cam.txt, or the calib.txt of odometry and of the stereo benchmarks.
import_pair import_kitti(const import_file &file, const import_options &options);

/// Which of the text formats a file has, by its contents.
bool import_opencv_matches(const std::string &text);
bool import_ros_matches(const std::string &text);
bool import_simrig_matches(const std::string &text);
bool import_kalibr_matches(const std::string &text);
bool import_euroc_matches(const std::string &text);
bool import_orbslam_matches(const std::string &text);
bool import_depthai_matches(const std::string &text);
bool import_realsense_matches(const std::string &text);
bool import_matrix_matches(const std::string &text);
bool import_mrcal_matches(const std::string &text);
bool import_middlebury_matches(const std::string &text);
bool import_kitti_matches(const std::string &text);

// Shared by the importers.

[[noreturn]] void import_fail(int code, const import_file &file, const std::string &what);

/// The JSON object in a file; rejects any other text, and one nested too deeply.
nlohmann::ordered_json import_json(const import_file &file);

/// All numbers of `text`, separated by blanks, commas or semicolons; exactly `count` of them,
/// finite. `place` names line and field for the message.
std::vector<double> import_numbers(const import_file &file, const std::string &place,
                                   const std::string &text, size_t count);

/// A text's lines with their numbers; a carriage return at the end of a line is dropped.
struct import_line {
    int number;
    std::string text;
};
std::vector<import_line> import_lines(const std::string &text);

/// The value of a name in a file of lines such as NAME: VALUES.
struct import_entry {
    int line;
    std::string text;
};
using import_entries = std::map<std::string, import_entry>;

/// All lines of a file, split at the first `separator`; blank ones are skipped. Rejects a line
/// without one, saying that it must be `form`, and a duplicate name.
import_entries import_read_entries(const import_file &file, char separator,
                                   const std::string &form);

/// The entry of this name; rejects a file without one.
const import_entry &import_require(const import_file &file, const import_entries &entries,
                                   const std::string &name);

/// "line 7, NAME", for messages. The entry must exist.
std::string import_place(const import_entries &entries, const std::string &name);

/// Focal lengths and principal point of a 3x3 camera matrix (row-major); rejects skew.
void import_camera_matrix(const import_file &file, const std::string &field,
                          const std::vector<double> &K, lens *camera);

/// Distortion coefficients in OpenCV's order (0, 4, 5, 8, 12 or 14 of them): Brown-Conrady, or
/// rational if one of k4 k5 k6 is not 0. Other terms are rejected by name.
void import_distortion(const import_file &file, const std::string &field,
                       const std::vector<double> &D, lens *camera);

/// The same for the four coefficients of the equidistant model (OpenCV's fisheye, Kalibr's equi).
void import_equidistant(const import_file &file, const std::string &field,
                        const std::vector<double> &D, lens *camera);

/// R_right_left (row-major) and translation; rejects a matrix that is not a rotation.
void import_pose(const import_file &file, const std::string &field, const std::vector<double> &R,
                 const double translation_mm[3], calibration *value);

/// A rectified pair from two 3x4 projections (row-major; lengths in units of `unit_mm`) in a common
/// frame. Sets `rectified`, lenses (without the size) and pose.
void import_projections(const import_file &file, const std::string &field,
                        const std::vector<double> &P_left, const std::vector<double> &P_right,
                        double unit_mm, import_pair *pair);

/// How one raw camera was rectified, as OpenCV's stereoRectify gives it (row-major): R maps its
/// frame into the rectified one, P = [f 0 cx Tx; 0 f cy Ty; 0 0 1 0] projects points of that.
struct import_rectified_camera {
    const std::vector<double> &R, &P;
};

/// The pose of raw cameras from their rectification. `fields`: names of R and P for messages.
void import_rectification(const import_file &file, const std::array<const char *, 2> &fields,
                          const import_rectified_camera &left, const import_rectified_camera &right,
                          double unit_mm, calibration *value);

/// Millimetres per unit that the options state, or 0 if they state none.
double import_stated_unit_mm(const import_options &options);

/// Millimetres per unit of the file's lengths: as the options state, or `format_mm`, what the
/// format prescribes (0: none; then mm).
double import_unit_mm(const import_options &options, double format_mm, import_pair *pair);

/// A right-handed frame's pose as a 4x4 matrix (row-major, its last row is ignored).
using import_matrix4 = std::array<double, 16>;

/// The pose that maps points of the left camera into the right one, from the poses that map both
/// into a common frame, or, with `from_common`, that frame into both. Rejects matrices that are no
/// poses.
void import_common_pose(const import_file &file, const std::string &field,
                        const import_matrix4 &left, const import_matrix4 &right, bool from_common,
                        double unit_mm, calibration *value);

/// Size of both cameras from the options; `format` names what does not state it.
void import_stated_size(const import_file &file, const std::string &format,
                        const import_options &options, import_pair *pair);

#endif

// SPDX-License-Identifier: Apache-2.0
/// Any calibration file: identifies the program that wrote it from its contents, and loads it.
#ifndef VERGENCE_TOOLS_HOST_CONVERT_CALIBRATION_FILE_HPP
#define VERGENCE_TOOLS_HOST_CONVERT_CALIBRATION_FILE_HPP

#include <string>
#include <vector>

#include "daemon/surface/calibration_loader.h"
#include "stereo/geometry/calibration.h"
#include "tools/host/convert/import.hpp"

/// The origin of the calibration.
struct calibration_file_report {
    std::string format;                // "vergence", "OpenCV", "ROS camera_info", "Middlebury", ...
    std::vector<std::string> files;    // all that were read
    std::vector<std::string> assumed;  // assumptions about what the files do not state
};

/// Loads a valid calibration, rounded to the decimals of our text, so that writing and reading it
/// changes nothing. `path` names
/// - a file of our own text, Middlebury's calib.txt, KITTI's calib_cam_to_cam.txt or calib.txt;
/// - one of a pair of files (OpenCV intrinsics and extrinsics, ROS left and right): its partner
///   is searched next to it;
/// - several files separated by commas, the left camera's or the intrinsics first;
/// - a directory with one of these under its conventional name.
/// The size in `options` is used only where the files state none; the caller checks whether the
/// images have the calibration's size. Returns 0, or a negative error code with `message` set to
/// one line that names file and field and says what to do; `value` and `report` (which may be null)
/// are then untouched. Throws nothing but std::bad_alloc.
int calibration_file_load(const std::string &path, const import_options &options,
                          calibration *value, calibration_file_report *report,
                          std::string *message);

/// The same for files in memory, the left camera's or the intrinsics first.
int calibration_file_convert(const std::vector<import_file> &files, const import_options &options,
                             calibration *value, std::string *message);

/// Writes the canonical text atomically: a partial file never has this name. Returns 0 or a
/// negative error code with `message` set.
int calibration_file_write(const std::string &path, const calibration &value, std::string *message);

/// `calibration_file_load` for the client (C).
extern "C" calibration_loader calibration_file_loader;

/// Rounds a calibration to the decimals of our text and validates it. Returns the result of
/// `calibration_validate`; `*fault` has the details.
int calibration_file_settle(calibration *value, calibration_fault *fault);

/// The sentence that says why our own text was rejected, without the file's name.
std::string calibration_file_explain(int code, const calibration_fault &fault);

#endif

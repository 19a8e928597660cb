// SPDX-License-Identifier: Apache-2.0
/// Lens tables of other programs from a calibration of all zooms: one file for each camera.
#ifndef VERGENCE_TOOLS_HOST_CONVERT_EXPORT_ZOOM_HPP
#define VERGENCE_TOOLS_HOST_CONVERT_EXPORT_ZOOM_HPP

#include "stereo/zoom/zoom_calibration.h"
#include "tools/host/convert/export.hpp"

/// The names of the tables, separated by blanks.
extern const char *const export_zoom_formats;

/// The files of a table, one of `export_zoom_formats`:
///   gyroflow      lens profile with `interpolations` over the focal length in mm, focused at
///                 infinity: left.json, right.json
///   opentrackio   a list of samples of OpenTrackIO over zoom and focus, with encoders 0 to 1 over
///                 the calibrated ranges: left.json, right.json
std::vector<export_file> export_zoom(const zoom_calibration &value, const std::string &format);

#endif

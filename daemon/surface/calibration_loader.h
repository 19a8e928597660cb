// SPDX-License-Identifier: Apache-2.0
/// Calibration files as the client sees them: the board knows our own text, the host's tools add
/// importers of other programs' files.
#ifndef VERGENCE_DAEMON_SURFACE_CALIBRATION_LOADER_H
#define VERGENCE_DAEMON_SURFACE_CALIBRATION_LOADER_H

#include "daemon/base/message.h"
#include "stereo/geometry/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CALIBRATION_LOADER_FORMAT_BYTES = 32 };

struct calibration_request {
    const char *path;                     // a file, or a directory that holds a pair of files
    int image_width_px, image_height_px;  // of the images it is for; 0: not known
    const char *unit;  // of lengths in files that have none: "mm", "cm", "m"; or NULL
    bool rectified;    // the images are rectified already: take the file's rectified cameras
    int first_camera;  // number of the left camera in files of several pairs; -1: the usual one
};

/// Loads a valid calibration. Returns 0 with `format` set to the name of the file's format, or a
/// negative error code with `message` set to one line that names the file.
typedef int calibration_loader(const struct calibration_request *request,
                               struct calibration *calibration,
                               char format[CALIBRATION_LOADER_FORMAT_BYTES],
                               struct message *message);

/// The loader of our own text, see core/calibration.h. When the request says rectified, so must
/// the text.
calibration_loader calibration_loader_own;

#ifdef __cplusplus
}
#endif

#endif

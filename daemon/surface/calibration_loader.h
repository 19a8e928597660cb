// SPDX-License-Identifier: Apache-2.0
/// How calibration files are read: the board reads only Vergence's own format; the host's tools add
/// importers for other programs' files.
#ifndef VERGENCE_DAEMON_SURFACE_CALIBRATION_LOADER_H
#define VERGENCE_DAEMON_SURFACE_CALIBRATION_LOADER_H

#include "daemon/base/message.h"
#include "stereo/geometry/calibration.h"
#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CALIBRATION_LOADER_FORMAT_BYTES = 32 };

struct calibration_request {
    const char *path;                     // a file, or a directory with a pair of files
    int image_width_px, image_height_px;  // size of the images; 0: unknown
    const char *unit;  // unit of lengths in files that state none: "mm", "cm", "m"; or NULL
    bool rectified;    // the images are already rectified: use the file's rectified cameras
    int first_camera;  // number of the left camera in files of several pairs; -1: the default
};

/// Loads a valid calibration. Returns 0 and sets `format` to the name of the file's format, or
/// returns a negative error code with one line in `message` that names the file.
typedef int calibration_loader(const struct calibration_request *request,
                               struct calibration *calibration,
                               char format[CALIBRATION_LOADER_FORMAT_BYTES],
                               struct message *message);

/// Loads Vergence's own text format, see stereo/geometry/calibration.h. If the request says
/// rectified, the calibration must be rectified too.
calibration_loader calibration_loader_own;

/// A calibration of all zooms from its file, allocated by malloc; NULL if the file is of another
/// kind. Errors as above.
int calibration_loader_zoom(const char *path, struct zoom_calibration **zoom,
                            struct message *message);

#ifdef __cplusplus
}
#endif

#endif

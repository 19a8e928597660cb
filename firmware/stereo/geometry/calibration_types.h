// SPDX-License-Identifier: Apache-2.0
/// The types of calibration.h.
#ifndef VERGENCE_STEREO_GEOMETRY_CALIBRATION_TYPES_H
#define VERGENCE_STEREO_GEOMETRY_CALIBRATION_TYPES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/geometry/lens.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CALIBRATION_ID_BYTES = 48,
    CALIBRATION_DATE_BYTES = 11,
    CALIBRATION_NOTE_BYTES = 240,
    CALIBRATION_NAME_BYTES = 64,
    CALIBRATION_TEXT_MAX_BYTES = 4096,
};

/// The axes of a camera. Pan in degrees from the servo's middle, the others in counts of the lens
/// controller.
enum calibration_axis_name {
    CALIBRATION_PAN,
    CALIBRATION_ZOOM,
    CALIBRATION_FOCUS,
    CALIBRATION_IRIS,
    CALIBRATION_AXES
};

enum calibration_axis_kind {
    CALIBRATION_AXIS_UNKNOWN,  // its position is not known
    CALIBRATION_AXIS_NONE,     // the instrument has no such axis
    CALIBRATION_AXIS_KNOWN,
};

/// Position of an axis while the calibration pictures were taken.
struct calibration_axis {
    enum calibration_axis_kind kind;
    double mean, spread;  // largest deviation from the mean; 0 unless known
};

/// The part of the sensor that the images show: column and row of the first pixel, and the step
/// between pixels.
struct calibration_window {
    int column_px, row_px, skip;  // skip 0: not known
};

struct calibration_side_origin {
    char camera[CALIBRATION_NAME_BYTES];  // serial number or port; "" if not known
    struct calibration_window window;
    struct calibration_axis axis[CALIBRATION_AXES];
};

/// The instrument that took the calibration pictures, and its axes.
struct calibration_origin {
    char instrument[CALIBRATION_NAME_BYTES];  // name of its profile; "" if not known
    struct calibration_side_origin side[2];   // left, right
};

struct calibration {
    char id[CALIBRATION_ID_BYTES];      // [A-Za-z0-9._-]+, names rig and occasion
    char date[CALIBRATION_DATE_BYTES];  // YYYY-MM-DD, or "" if unknown
    char note[CALIBRATION_NOTE_BYTES];  // printable ASCII: assumptions made; may be ""
    bool rectified;                     // rows already correspond: images are not resampled
    struct lens left, right;
    double rotation_right_left_rad[3];    // rotation vector of R_right_left
    double translation_right_left_mm[3];  // point_right = R_right_left point_left + t
    double depth_near_mm, depth_far_mm;   // working range of left z; 0 0 if not stated
    double rms_px;                        // reprojection rms per point; 0 if not stated
    /// True: printed as version 2 of the text (3 with `axes_in_sigma`), which includes the fields
    /// below. False: version 1, which does not have them; `origin` and the sigmas then count as not
    /// known. A lens that is not Brown-Conrady takes version 4, which has all fields.
    bool has_origin;
    struct calibration_origin origin;
    /// Uncertainty of the calibration itself, as one standard deviation: relative error common to
    /// all depths, and the angle between the cameras. 0: not stated.
    double scale_sigma, yaw_sigma_rad;
    /// Whether these include how well the axes stand where `origin` says, as for the calibration of
    /// one state of a zoom calibration. False: the axes' repeatability comes on top.
    bool axes_in_sigma;
};

/// Where and why a text was rejected.
struct calibration_fault {
    int line;            // 1-based; 0 if it does not concern a single line
    const char *field;   // name of the field, static storage; "" if it does not concern a field
    const char *reason;  // what is wrong, static storage; "" if the code is enough
    uint32_t crc;        // correct checksum of the text; set with ERROR_CRC
};

#ifdef __cplusplus
}
#endif

#endif

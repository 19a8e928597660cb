// SPDX-License-Identifier: Apache-2.0
/// The calibration of a stereo pair and its canonical text: print(parse(text)) == text,
/// closed by a CRC-32. Every number is a decimal with a fixed count of decimals, so that
/// parsing and printing are exact on every target. The grammar is the field list in
/// calibration_grammar.c; parser, printer, validation and documentation derive from it.
#ifndef VERGENCE_STEREO_GEOMETRY_CALIBRATION_H
#define VERGENCE_STEREO_GEOMETRY_CALIBRATION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/geometry/lens.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CALIBRATION_ID_BYTES = 48,
    CALIBRATION_NOTE_BYTES = 240,
    CALIBRATION_NAME_BYTES = 64,
    CALIBRATION_TEXT_MAX_BYTES = 4096,
};

/// The axes of a side. Pan in degrees from the servo's middle, the others in the counts that the
/// lens controller reads.
enum calibration_axis_name {
    CALIBRATION_PAN,
    CALIBRATION_ZOOM,
    CALIBRATION_FOCUS,
    CALIBRATION_IRIS,
    CALIBRATION_AXES
};

enum calibration_axis_kind {
    CALIBRATION_AXIS_UNKNOWN,  // where it stood is not known
    CALIBRATION_AXIS_NONE,     // the instrument has no such axis
    CALIBRATION_AXIS_KNOWN,
};

/// Where an axis stood while the pictures were taken.
struct calibration_axis {
    enum calibration_axis_kind kind;
    double mean, spread;  // spread: the largest deviation from the mean; 0 unless known
};

/// The part of the sensor that the images show: column and row of their first pixel, and the step
/// from one pixel to the next.
struct calibration_window {
    int column_px, row_px, skip;  // skip 0: not known
};

struct calibration_side_origin {
    char camera[CALIBRATION_NAME_BYTES];  // serial number or port; "" when not known
    struct calibration_window window;
    struct calibration_axis axis[CALIBRATION_AXES];
};

/// What pictures were taken with: which instrument, and where its axes stood.
struct calibration_origin {
    char instrument[CALIBRATION_NAME_BYTES];  // name of its profile; "" when not known
    struct calibration_side_origin side[2];   // left, right
};

struct calibration {
    char id[CALIBRATION_ID_BYTES];      // [A-Za-z0-9._-]+, names the rig and the occasion
    char date[11];                      // YYYY-MM-DD, or "" when unknown
    char note[CALIBRATION_NOTE_BYTES];  // printable ASCII, what is assumed; may be ""
    bool rectified;                     // rows already correspond: images pass through as they are
    struct lens left, right;
    double rotation_right_left_rad[3];    // rotation vector of R_right_left
    double translation_right_left_mm[3];  // point_right = R_right_left point_left + t
    double depth_near_mm, depth_far_mm;   // working range of left z; 0 0 when not stated
    double rms_px;                        // reprojection rms per point; 0 when not stated
    /// Printed as version 2 of the text, which has what follows. False: version 1, which says
    /// nothing of it; `origin` and the sigmas count as not known then.
    bool has_origin;
    struct calibration_origin origin;
    /// What the calibration itself leaves uncertain, as one standard deviation: all depths by this
    /// share, and the angle between the cameras. 0: not stated.
    double scale_sigma, yaw_sigma_rad;
};

/// Where and why a text was refused.
struct calibration_fault {
    int line;            // 1-based; 0 when it is not about one line
    const char *field;   // name of the field in question, static storage; "" when none
    const char *reason;  // what is wrong, static storage; "" when the code says it all
    uint32_t crc;        // with ERROR_CRC: the checksum that the text as it stands should state
};

/// Parses `length` bytes of canonical text. On error returns a negative code, fills `fault`
/// (may be NULL) and leaves `result` untouched. The result is validated.
/// ERROR_VERSION, ERROR_SYNTAX, ERROR_MISSING, ERROR_DUPLICATE, ERROR_RANGE, ERROR_CRC, and what
/// `calibration_validate` returns.
int calibration_parse(const char *text, size_t length, struct calibration *result,
                      struct calibration_fault *fault);

/// Prints the canonical text with its CRC line into `text` (zero-terminated). Returns the
/// length without the zero, or ERROR_BUFFER, or what `calibration_validate` returns. Values are
/// rounded to the decimals of the grammar first; the rounded ones are what is validated, so
/// that every printed text can be parsed.
int calibration_print(const struct calibration *calibration, char *text, size_t size_bytes);

/// Rounds every number to the decimals of the grammar, as a print followed by a parse would.
/// ERROR_RANGE for values outside their ranges (NaN among them); `calibration` is then untouched.
int calibration_round(struct calibration *calibration);

/// Checks all values: texts, finite, ranges, baseline 1e-3 mm..1e5 mm, rotation of at most pi,
/// lens validity, equal ideal cameras with equal rows when `rectified`. `fault` may be NULL.
/// ERROR_SYNTAX (texts), ERROR_RANGE, ERROR_BASELINE, ERROR_ROTATION, ERROR_DEPTH_RANGE and what
/// `lens_validate` returns.
int calibration_validate(const struct calibration *calibration, struct calibration_fault *fault);

/// CRC-32 of the canonical text before its CRC line, the same number as on that line: the
/// calibration's identity. The calibration must be valid.
uint32_t calibration_crc(const struct calibration *calibration);

/// Standard deviation in mm that all points at `depth_mm` share because of the calibration:
/// the scale, and the angle between the cameras, by dz = z^2 / baseline * dyaw. 0: not stated.
double calibration_depth_sigma_mm(const struct calibration *calibration, double depth_mm);

/// Length of the baseline in mm.
double calibration_baseline_mm(const struct calibration *calibration);

/// Left-frame depth at which the two optical axes pass closest, or a negative number when they do
/// not converge in front of the cameras.
double calibration_vergence_depth_mm(const struct calibration *calibration);

#ifdef __cplusplus
}
#endif

#endif

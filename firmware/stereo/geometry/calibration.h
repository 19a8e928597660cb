// SPDX-License-Identifier: Apache-2.0
/// The calibration of a stereo pair and its canonical text: print(parse(text)) == text, ended by a
/// CRC-32. Every number has a fixed count of decimals, so that parsing and printing are exact on
/// every target. The grammar is the field list in calibration_grammar.c; parser, printer,
/// validation and documentation are derived from it.
#ifndef VERGENCE_STEREO_GEOMETRY_CALIBRATION_H
#define VERGENCE_STEREO_GEOMETRY_CALIBRATION_H

#include "stereo/geometry/calibration_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Parses `length` bytes of canonical text. On error returns a negative code, fills `fault` (may be
/// NULL) and leaves `result` unchanged. The result is validated. Errors: ERROR_VERSION,
/// ERROR_SYNTAX, ERROR_MISSING, ERROR_DUPLICATE, ERROR_RANGE, ERROR_CRC, and those of
/// `calibration_validate`.
int calibration_parse(const char *text, size_t length, struct calibration *result,
                      struct calibration_fault *fault);

/// Prints the canonical text with its CRC line into `text` (zero-terminated). Returns the length
/// without the zero, or ERROR_BUFFER, or an error of `calibration_validate`. Values are first
/// rounded to the decimals of the grammar, then validated, so that every printed text can be
/// parsed.
int calibration_print(const struct calibration *calibration, char *text, size_t size_bytes);

/// Rounds every number to the decimals of the grammar, as printing and parsing would. ERROR_RANGE
/// for values outside their ranges (including NaN), ERROR_SYNTAX for illegal texts; `calibration`
/// is then unchanged.
int calibration_round(struct calibration *calibration);

/// Checks all values: texts, finite, ranges, baseline 1e-3 mm..1e5 mm, rotation of at most pi,
/// valid lenses, and equal ideal cameras with equal rows if `rectified`. `fault` may be NULL.
/// Errors: ERROR_SYNTAX (texts), ERROR_RANGE, ERROR_BASELINE, ERROR_ROTATION, ERROR_DEPTH_RANGE and
/// what `lens_validate` returns.
int calibration_validate(const struct calibration *calibration, struct calibration_fault *fault);

/// CRC-32 of the canonical text before its CRC line, the number stated on that line. It identifies
/// the calibration, which must be valid.
uint32_t calibration_crc(const struct calibration *calibration);

/// Standard deviation in mm, common to all points at `depth_mm`, due to the calibration: the scale,
/// and the angle between the cameras by dz = z^2 / baseline * dyaw. 0: not stated.
double calibration_depth_sigma_mm(const struct calibration *calibration, double depth_mm);

/// Length of the baseline in mm.
double calibration_baseline_mm(const struct calibration *calibration);

/// Left-frame depth at which the optical axes pass closest; negative if they do not converge in
/// front of the cameras.
double calibration_vergence_depth_mm(const struct calibration *calibration);

#ifdef __cplusplus
}
#endif

#endif

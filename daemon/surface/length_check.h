// SPDX-License-Identifier: Apache-2.0
/// Lengths are in mm everywhere. Values that were probably typed in metres, or in mm where a format
/// has metres, are rejected unless --unit confirms them, as no pair of cameras measures at such
/// lengths.
#ifndef VERGENCE_DAEMON_SURFACE_LENGTH_CHECK_H
#define VERGENCE_DAEMON_SURFACE_LENGTH_CHECK_H

#include <stdbool.h>

#include "daemon/base/message.h"
#include "stereo/geometry/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The limits. In metres, boards measure up to 2, baselines up to 2, and the nearest depth is 0.05
/// to 5: all below the limits, while real values in mm rarely are.
/// - Longer side of a board, over all squares: micro boards for microscopes start at about 20 mm.
/// - Baseline: the smallest stereo modules have 6 mm, most endoscopes 4 to 5 mm; the latter need
///   --unit. The longest on vehicles have 2 m, those of buildings and ships some 10 m. A baseline
///   in mm that is read as metres is 5 m to 2 km.
/// - Nearest depth: twice that baseline; nearer, the views hardly overlap.
#define LENGTH_MIN_BOARD_MM 20.0
#define LENGTH_MIN_BASELINE_MM 5.0
#define LENGTH_MAX_BASELINE_MM 10000.0
#define LENGTH_MIN_DEPTH_MM 10.0

/// Remedy for a baseline of a file, for commands that have the option --unit.
extern const char length_unit_option[];

/// Returns 0, or ERROR_BASELINE with `message` set if the baseline is implausibly short or long.
/// The message begins with `name` (of a file, or "--baseline") and ends with `remedy`.
int length_check_baseline(double baseline_mm, const char *name, const char *remedy,
                          struct message *message);

/// The same for depths that begin too near: ERROR_RANGE. 0 means not given.
int length_check_depth(double near_mm, double far_mm, const char *name, const char *remedy,
                       struct message *message);

/// Whether one camera is in front of the other rather than beside it, so that their rows cannot
/// correspond; `message` then says so in one line, with ERROR_OVERLAP.
bool length_check_in_line(const struct calibration *calibration, struct message *message);

#ifdef __cplusplus
}
#endif

#endif

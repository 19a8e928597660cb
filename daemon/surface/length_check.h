// SPDX-License-Identifier: Apache-2.0
/// Lengths are in mm everywhere. Whoever types metres gets lengths that no pair of cameras measures
/// with: these are not taken but asked about, unless --unit says that they are meant.
#ifndef VERGENCE_DAEMON_SURFACE_LENGTH_CHECK_H
#define VERGENCE_DAEMON_SURFACE_LENGTH_CHECK_H

#include "daemon/base/message.h"
#include "stereo/geometry/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The limits. In metres, boards are up to 2 across, baselines up to 2, and what is measured begins
/// at 0.05 to 5: all of these are below the limits, and what is real is hardly ever.
/// - A board's longer side, all squares counted: micro boards for microscopes begin at some 20 mm.
/// - A baseline: the lenses of the smallest stereo modules stand 6 mm apart, those of most
///   endoscopes 4 to 5 mm, which have to say so.
/// - The nearest depth: twice that baseline; nearer, both views hardly overlap.
#define LENGTH_MIN_BOARD_MM 20.0
#define LENGTH_MIN_BASELINE_MM 5.0
#define LENGTH_MIN_DEPTH_MM 10.0

/// What --unit does about a baseline: the remedy where there is that option.
extern const char length_unit_option[];

/// Returns 0, or ERROR_BASELINE with `message` set: the baseline is too short to be believed. The
/// message begins with `name` (a file's, "--baseline") and ends with `remedy`.
int length_check_baseline(double baseline_mm, const char *name, const char *remedy,
                          struct message *message);

/// Likewise ERROR_RANGE for depths that begin too near; 0 stands for none.
int length_check_depth(double near_mm, double far_mm, const char *name, const char *remedy,
                       struct message *message);

#ifdef __cplusplus
}
#endif

#endif

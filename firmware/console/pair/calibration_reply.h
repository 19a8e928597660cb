// SPDX-License-Identifier: Apache-2.0
/// What the command "calibration" reports of a calibration.
#ifndef VERGENCE_CONSOLE_PAIR_CALIBRATION_REPLY_H
#define VERGENCE_CONSOLE_PAIR_CALIBRATION_REPLY_H

#include "console/command.h"
#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Name and unit of an axis (enum calibration_axis_name). Static storage.
const char *calibration_reply_axis_name(int axis);
const char *calibration_reply_axis_unit(int axis);

/// Of one state: identity, baseline, and the axes with which it was made.
void calibration_reply_put(const struct command_call *call, const struct calibration *calibration);

/// Of all zooms: identity, calibrated ranges, and how well it was checked.
void calibration_reply_put_zoom(const struct command_call *call,
                                const struct zoom_calibration *zoom);

#ifdef __cplusplus
}
#endif

#endif

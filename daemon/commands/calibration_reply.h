// SPDX-License-Identifier: Apache-2.0
/// What the command "calibration" reports of a calibration.
#ifndef VERGENCE_DAEMON_COMMANDS_CALIBRATION_REPLY_H
#define VERGENCE_DAEMON_COMMANDS_CALIBRATION_REPLY_H

#include "console/command.h"
#include "stereo/zoom/zoom_calibration.h"

/// Of one state: identity, baseline, and the axes with which it was made.
void calibration_reply_put(const struct command_call *call, const struct calibration *calibration);

/// Of all zooms: identity, calibrated ranges, and how well it was checked.
void calibration_reply_put_zoom(const struct command_call *call,
                                const struct zoom_calibration *zoom);

#endif

// SPDX-License-Identifier: Apache-2.0
/// Whether a camera's data lines reach the port, each of them and none other. For rig/ alone.
#ifndef VERGENCE_RIG_RIG_LINES_H
#define VERGENCE_RIG_RIG_LINES_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Lets the sensor send two known values, in a small window that it keeps, and looks at what comes.
/// Errors as rig_camera_take; ERROR_VERIFY: a line is dead; ERROR_FRAME: frames come torn.
/// `trouble` says which.
int rig_lines_check(struct rig *self, unsigned side);

#ifdef __cplusplus
}
#endif

#endif

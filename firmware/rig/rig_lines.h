// SPDX-License-Identifier: Apache-2.0
/// Checks that each data line of a camera reaches the port, and is not swapped with another. For
/// rig/ only.
#ifndef VERGENCE_RIG_RIG_LINES_H
#define VERGENCE_RIG_RIG_LINES_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Makes the sensor send two known values in a small window, and checks what arrives. Errors as
/// rig_camera_take; ERROR_VERIFY: a line is dead; ERROR_FRAME: damaged frames. `trouble` is set.
int rig_lines_check(struct rig *self, unsigned side);

#ifdef __cplusplus
}
#endif

#endif

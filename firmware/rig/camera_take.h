// SPDX-License-Identifier: Apache-2.0
/// A frame of one camera, whatever makes it expose. For rig/ only; errors as in rig/rig_camera.h.
#ifndef VERGENCE_RIG_CAMERA_TAKE_H
#define VERGENCE_RIG_CAMERA_TAKE_H

#include "rig/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Waits for a complete frame that began at `not_before_us` or later, with all settings in force,
/// and exposed with pan and lens at rest, as far as its exposure is known. The caller must give it
/// back. Faults that the bridge found are included in its `faults`. Selects the camera behind the
/// bridge if necessary, and pulses the trigger line if there is one.
int rig_camera_take(struct rig *self, unsigned side, uint64_t not_before_us,
                    struct hal_camera_frame *frame);

#ifdef __cplusplus
}
#endif

#endif

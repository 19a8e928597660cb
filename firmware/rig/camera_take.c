// SPDX-License-Identifier: Apache-2.0
#include "rig/camera_take.h"

#include "rig/rig_camera.h"
#include "rig/trigger.h"

int rig_camera_take(struct rig *self, unsigned side, uint64_t not_before_us,
                    struct hal_camera_frame *frame) {
    return self->profile.trigger ? trigger_take_one(self, side, frame)
                                 : rig_camera_take_running(self, side, not_before_us, frame);
}

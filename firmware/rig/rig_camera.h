// SPDX-License-Identifier: Apache-2.0
/// Frames of one camera, which has its own port or shares one behind the bridge. For rig/ only.
///
/// After an error `last_error` is set; the rig is not made safe here. ERROR_CANCELLED: by the
/// observer.
#ifndef VERGENCE_RIG_RIG_CAMERA_H
#define VERGENCE_RIG_RIG_CAMERA_H

#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// After this time the bridge switches to another source even if no frame of the old one ends.
enum { RIG_CAMERA_SWITCH_LIMIT_MS = 120 };

/// Frame period with the camera's settings. Where no sensor reports it, an upper bound: that of the
/// profile, or the exposure that was set or found, if that is longer.
uint64_t rig_camera_frame_us(const struct rig *self, unsigned side);

/// Starts frames of this size from both cameras. Does not change the sensors behind the bridge.
int rig_camera_start(struct rig *self, const struct hal_camera_format *format);
/// The same for one camera with its own port.
int rig_camera_start_side(struct rig *self, unsigned side, const struct hal_camera_format *format);
/// Reads the present exposure of a camera with its own port, as frames may take that long. Cameras
/// that do not report it count as 0; whether the camera works shows in its frames.
void rig_camera_find_exposure(struct rig *self, unsigned side);
/// Stops the frames. Returns the first error.
int rig_camera_stop(struct rig *self);

/// To be called after a settings change was sent: only frames with the new settings count from now
/// on. `before_us`: the frame period before the change.
void rig_camera_unsettle(struct rig *self, unsigned side, uint64_t before_us);

/// As rig_camera_take (rig/trigger.h), for cameras that do not wait for the trigger line.
int rig_camera_take_running(struct rig *self, unsigned side, uint64_t not_before_us,
                            struct hal_camera_frame *frame);
/// The same for the first frame of a free-running camera with its own port: waits as long after its
/// start as webcams need, plus its exposure, however long the wait for the other camera took.
int rig_camera_take_first(struct rig *self, unsigned side, struct hal_camera_frame *frame);

/// Checks that each data line of a camera reaches the port and is not swapped with another. Makes
/// the sensor send two known values in a small window, and checks what arrives. Errors as
/// rig_camera_take; ERROR_VERIFY: a line is dead; ERROR_FRAME: damaged frames. `last_error` is set.
int rig_lines_check(struct rig *self, unsigned side);

#ifdef __cplusplus
}
#endif

#endif

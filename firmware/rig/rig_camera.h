// SPDX-License-Identifier: Apache-2.0
/// Frames of one camera, whether it has a port of its own or shares one behind the bridge. For
/// rig/ alone.
///
/// Errors of all: `trouble` says what it was; nothing is made safe here. ERROR_CANCELLED: the
/// observer.
#ifndef VERGENCE_RIG_RIG_CAMERA_H
#define VERGENCE_RIG_RIG_CAMERA_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// After so long the bridge goes over to another source even where no frame of the old one ends.
enum { RIG_CAMERA_SWITCH_LIMIT_MS = 120 };

/// From frame to frame, as the camera is set; where no sensor tells at most that: what the profile
/// says, or the exposure that was set or found, where that is longer.
uint64_t rig_camera_frame_us(const struct rig *self, unsigned side);

/// Frames of this size from now on, from both cameras. Behind the bridge the sensors are not told.
int rig_camera_start(struct rig *self, const struct hal_camera_format *format);
/// The same for one camera with a port of its own.
int rig_camera_start_side(struct rig *self, unsigned side, const struct hal_camera_format *format);
/// Asks a camera with a port of its own for the exposure that it still has, as frames may take as
/// long. One that does not say has none; whether it works is for its frames to show.
void rig_camera_find_exposure(struct rig *self, unsigned side);
/// No frames any more. The first error.
int rig_camera_stop(struct rig *self);

/// A change of the sensor's settings was sent: frames are believed only after it. `before_us`: the
/// time from frame to frame as it was.
void rig_camera_unsettle(struct rig *self, unsigned side, uint64_t before_us);

/// Waits for a whole frame that began at `not_before_us` or later, with all settings in force, and
/// exposed, as far as its exposure is known, when pan and lens rested; lends it. What the bridge
/// found wrong with it is in its `faults` too. Chooses the camera behind the bridge when that is
/// needed, and pulses the trigger line where there is one.
int rig_camera_take(struct rig *self, unsigned side, uint64_t not_before_us,
                    struct hal_camera_frame *frame);
/// The same for the first frame of a camera with a port of its own that runs freely: as long after
/// its start as webcams take and its exposure explains, however long somebody waited for the other
/// one.
int rig_camera_take_first(struct rig *self, unsigned side, struct hal_camera_frame *frame);
void rig_camera_give_back(struct rig *self, unsigned side, const struct hal_camera_frame *frame);

#ifdef __cplusplus
}
#endif

#endif

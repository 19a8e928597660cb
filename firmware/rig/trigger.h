// SPDX-License-Identifier: Apache-2.0
/// Cameras with their own ports that expose when a line goes active, both at the same time. For
/// rig/ only.
///
/// A frame belongs to a pulse if it was complete after the pulse began: frames that a camera still
/// held are dropped first, so the exact time stamp of the first pixel does not matter.
///
/// After an error `last_error` is set. The rig is not made safe here, but the line is inactive
/// after every call, as far as it can be driven. ERROR_CANCELLED: by the observer.
#ifndef VERGENCE_RIG_TRIGGER_H
#define VERGENCE_RIG_TRIGGER_H

#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Number of pulses for a frame that does not arrive, or arrives incomplete.
enum { TRIGGER_ATTEMPTS = 3 };

/// Deactivates the line.
int trigger_rest(struct rig *self);

/// Drops buffered frames and those under way, then pulses the line once, with all settings in
/// force.
int trigger_fire(struct rig *self);

/// Waits for a camera's frame of the last pulse; the caller releases its image. ERROR_TIMEOUT: it
/// does not arrive; the message names camera and line.
int trigger_take(struct rig *self, unsigned side, struct hal_camera_frame *frame);

/// Takes a frame of one camera, whose image the caller releases: pulses until it arrives, at most
/// TRIGGER_ATTEMPTS times.
int trigger_take_one(struct rig *self, unsigned side, struct hal_camera_frame *frame);

/// Takes and drops a frame of each streaming camera, with at most TRIGGER_ATTEMPTS pulses. `found`:
/// the result of each side, with error 0 if a frame came. Returns errors of the line and of the
/// observer; `found` is then not set.
int trigger_look(struct rig *self, struct rig_error found[RIG_SIDES]);

/// Whether both cameras wait for the line: no frame may come without a pulse within twice the
/// longest frame period. ERROR_VERIFY: a camera runs freely.
int trigger_check_quiet(struct rig *self);

/// A frame of one camera, of a trigger pulse or of its running stream; errors as in rig_camera.h.
/// Waits for a complete frame that began at `not_before_us` or later, with all settings in force,
/// and exposed with pan and lens at rest, as far as its exposure is known. The caller releases its
/// image. Faults that the bridge found are included in its `faults`. Selects the camera behind the
/// bridge if necessary, and pulses the trigger line if there is one.
int rig_camera_take(struct rig *self, unsigned side, uint64_t not_before_us,
                    struct hal_camera_frame *frame);

#ifdef __cplusplus
}
#endif

#endif

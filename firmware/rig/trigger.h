// SPDX-License-Identifier: Apache-2.0
/// Cameras with ports of their own that expose when a line goes active: both at the same time. For
/// rig/ alone.
///
/// A frame belongs to a pulse when it was whole after the pulse began: what a camera held of before
/// is dropped first, so nothing depends on how exactly a driver stamps the first pixel.
///
/// Errors of all: `trouble` says what it was. Nothing is made safe here, but the line is at rest
/// after every call, as far as it can be driven. ERROR_CANCELLED: the observer.
#ifndef VERGENCE_RIG_TRIGGER_H
#define VERGENCE_RIG_TRIGGER_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// So often the line is pulsed for a frame that does not come, or not whole.
enum { TRIGGER_ATTEMPTS = 3 };

/// Brings the line to rest.
int trigger_rest(struct rig *self);

/// Drops what the cameras hold, and what is still under way, then pulses the line once, with all
/// settings in force.
int trigger_fire(struct rig *self);

/// Waits for a camera's frame of the last pulse, and lends it. ERROR_TIMEOUT: it does not come; the
/// message names camera and line.
int trigger_take(struct rig *self, unsigned side, struct hal_camera_frame *frame);

/// A frame of one camera, which is lent: pulses until it comes, TRIGGER_ATTEMPTS times at most.
int trigger_take_one(struct rig *self, unsigned side, struct hal_camera_frame *frame);

/// A frame of each camera that streams, which nobody gets, over TRIGGER_ATTEMPTS pulses at most.
/// `found`: the trouble of each side, whose error is 0 where a frame came. Returns errors of the
/// line and of the observer; `found` is not set then.
int trigger_look(struct rig *self, struct rig_trouble found[RIG_SIDES]);

/// Whether both cameras wait for the line: in twice the longest time between frames none comes by
/// itself. ERROR_VERIFY: one runs freely.
int trigger_check_quiet(struct rig *self);

#ifdef __cplusplus
}
#endif

#endif

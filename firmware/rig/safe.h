// SPDX-License-Identifier: Apache-2.0
/// The safe state of the rig, and the way there after a failure.
#ifndef VERGENCE_RIG_SAFE_H
#define VERGENCE_RIG_SAFE_H

#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Stops motors and streams, ends the servo pulses, and deactivates the trigger line. Continues if
/// a part fails. Returns the first error.
int rig_safe(struct rig *self);

/// Ends a call of the rig: if the bridge stopped accepting feeds meanwhile (rig_watchdog_feed), the
/// rig is made safe, and the message stays. Returns `error`.
int rig_end(struct rig *self, int error);

/// Calls rig_safe without reporting its own failures: the message stays. Returns `error`.
int rig_fail_safe(struct rig *self, int error);

#ifdef __cplusplus
}
#endif

#endif

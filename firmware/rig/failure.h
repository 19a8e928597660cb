// SPDX-License-Identifier: Apache-2.0
/// Handling of a failed part: the rig is made safe, and the message stays that of the failure. For
/// rig/ only.
#ifndef VERGENCE_RIG_FAILURE_H
#define VERGENCE_RIG_FAILURE_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The part of a side, given that of the left side.
enum rig_part failure_part(enum rig_part left, unsigned side);

/// Sets `trouble` to a failed I2C transfer: what is wrong, and what to do. Returns `error`.
int failure_of_bus(struct rig *self, enum rig_part part, int error);

/// Records that the bridge was used with this result, and on an error sets `trouble` as
/// failure_of_bus does. Returns `error`.
int failure_of_bridge(struct rig *self, int error);

/// Ends a call of the rig: if the bridge stopped accepting feeds meanwhile (watch_feed), the rig is
/// made safe, and the message stays. Returns `error`.
int failure_end(struct rig *self, int error);

/// Calls rig_safe without reporting its own failures: the message stays. Returns `error`.
int failure_make_safe(struct rig *self, int error);

#ifdef __cplusplus
}
#endif

#endif

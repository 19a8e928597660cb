// SPDX-License-Identifier: Apache-2.0
/// What happens when a part has failed: the rig is made safe, and the message stays that of the
/// failure. For rig/ alone.
#ifndef VERGENCE_RIG_FAILURE_H
#define VERGENCE_RIG_FAILURE_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The part of a side, by that of the left one.
enum rig_part failure_part(enum rig_part left, unsigned side);

/// Sets `trouble` to a failed transfer on I2C: what is wrong with this error, and what to do.
/// Returns `error`.
int failure_of_bus(struct rig *self, enum rig_part part, int error);

/// A result of the bridge's driver: notes that the bridge was used, and tells where it failed, as
/// failure_of_bus. Returns `error`.
int failure_of_bridge(struct rig *self, int error);

/// What a call of the rig ends with: where the bridge took no feed meanwhile (watch_feed), all is
/// made safe, and the message stays. Returns `error`.
int failure_end(struct rig *self, int error);

/// Calls rig_safe, whose own failures are not told: those of before are. Returns `error`.
int failure_make_safe(struct rig *self, int error);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// What every long call of the rig does besides its own work: feed the bridge's watchdog, check for
/// cancellation, and record uses and failures of parts. For rig/ only.
#ifndef VERGENCE_RIG_WATCH_H
#define VERGENCE_RIG_WATCH_H

#include "rig/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A waiting call gets here at least this often (us); the observer is promised 100 ms.
enum { WATCH_STEP_US = 50000 };

/// The rig's clock, in us.
uint64_t watch_now_us(const struct rig *self);

/// Feeds the bridge's watchdog if due (and if the profile has a bridge that was brought up), then
/// checks for cancellation. Returns 0, ERROR_CANCELLED, or an error of the bridge with `last_error`
/// set and the rig RIG_SAFE (its watchdog, without feeds, brings the servos to rest).
int watch_look(struct rig *self);

/// As watch_look, but without cancellation: for the way to rest, which cannot be cancelled.
int watch_feed(struct rig *self);

/// Records that a feed arrived, at the time of the bridge's last use.
void watch_fed(struct rig *self);

/// Waits until `until_us`, with watch_look before and during the wait, but not after. Returns at
/// once with an error of watch_look.
int watch_until(struct rig *self, uint64_t until_us);

/// Records in `health` that a part was used with this result. Returns `error`.
int watch_used(struct rig *self, enum rig_part part, int error);

/// Sets `last_error` to "<part>: <what>", with each # of `what` replaced by the next of `numbers`
/// (NULL: no replacement); text that is too long is cut off. Returns `error`.
int watch_error(struct rig *self, enum rig_part part, int error, const char *what,
                const int32_t *numbers);

/// The same for a part that does not work: if its device could not be opened, the reason for that,
/// else `what`, without numbers. Returns `error`.
int watch_failed(struct rig *self, enum rig_part part, int error, const char *what);

/// As watch_error, but sets `rejected`.
int watch_rejection(struct rig *self, enum rig_part part, int error, const char *what,
                    const int32_t *numbers);

#ifdef __cplusplus
}
#endif

#endif

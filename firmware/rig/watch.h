// SPDX-License-Identifier: Apache-2.0
/// What every long call of the rig does besides its own work: the bridge's watchdog is fed, the
/// observer is asked whether to go on, uses and failures of parts are noted. For rig/ alone.
#ifndef VERGENCE_RIG_WATCH_H
#define VERGENCE_RIG_WATCH_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A call that waits comes here at least as often (us); the observer is promised 100 ms.
enum { WATCH_STEP_US = 50000 };

/// The rig's clock, in us.
uint64_t watch_now_us(const struct rig *self);

/// Feeds the bridge's watchdog when it is time (where the profile has a bridge and it was brought
/// up), then asks the observer. 0; ERROR_CANCELLED; an error of the bridge, with the rig RIG_SAFE
/// (the hungry watchdog brings the servos to rest) and `trouble` set.
int watch_look(struct rig *self);

/// As watch_look, but nobody is asked: for the way back to rest, which cannot be cancelled.
int watch_feed(struct rig *self);

/// Notes that a feed has arrived, by the bridge's last use.
void watch_fed(struct rig *self);

/// Waits until `until_us`, looking before, meanwhile and not after. The errors of watch_look, then
/// at once.
int watch_until(struct rig *self, uint64_t until_us);

/// Notes in `health` that a part was used with this result, which it returns.
int watch_used(struct rig *self, enum rig_part part, int error);

/// Writes `trouble`: "<part>: <what>", each # of `what` replaced by the next of `numbers` (NULL:
/// there is none); a text that is too long is cut off. Returns `error`.
int watch_trouble(struct rig *self, enum rig_part part, int error, const char *what,
                  const int32_t *numbers);

/// The same for a part that does not work: why its device could not be opened, where it could not,
/// else `what`, without numbers. Returns `error`.
int watch_failed(struct rig *self, enum rig_part part, int error, const char *what);

/// As watch_trouble, but into `refusal`.
int watch_refusal(struct rig *self, enum rig_part part, int error, const char *what,
                  const int32_t *numbers);

#ifdef __cplusplus
}
#endif

#endif

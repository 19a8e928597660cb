// SPDX-License-Identifier: Apache-2.0
/// Waits of the rig: each feeds the bridge's watchdog and checks for cancellation. For rig/ only.
#ifndef VERGENCE_RIG_BASE_POLL_H
#define VERGENCE_RIG_BASE_POLL_H

#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A call that waits calls rig_poll at least this often (us); the observer is promised 100 ms.
enum { RIG_POLL_US = 50000 };

/// Only checks for cancellation: 0 or ERROR_CANCELLED. Makes no call of a port.
int rig_poll_observer(const struct rig *self);

/// Feeds the bridge's watchdog if due (watchdog.h), then checks for cancellation. Returns 0,
/// ERROR_CANCELLED, or an error of the bridge as rig_watchdog_feed.
int rig_poll(struct rig *self);

/// Waits until `until_us`, with rig_poll before and during the wait, but not after. Returns at once
/// with an error of rig_poll.
int rig_wait_until(struct rig *self, uint64_t until_us);

#ifdef __cplusplus
}
#endif

#endif

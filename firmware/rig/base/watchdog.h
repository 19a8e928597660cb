// SPDX-License-Identifier: Apache-2.0
/// Feeds of the bridge's watchdog, which brings the servos to rest when none arrives. For rig/
/// only.
#ifndef VERGENCE_RIG_BASE_WATCHDOG_H
#define VERGENCE_RIG_BASE_WATCHDOG_H

#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Feeds the watchdog if due, and if the profile has a bridge that was brought up. Returns 0, or an
/// error of the bridge with `last_error` set and the rig RIG_SAFE. Cannot be cancelled.
int rig_watchdog_feed(struct rig *self);

/// Records that a feed arrived, at the time of the bridge's last use.
void rig_watchdog_fed(struct rig *self);

#ifdef __cplusplus
}
#endif

#endif

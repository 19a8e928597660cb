// SPDX-License-Identifier: Apache-2.0
/// What the last uses of each part resulted in. For rig/ only.
#ifndef VERGENCE_RIG_BASE_HEALTH_H
#define VERGENCE_RIG_BASE_HEALTH_H

#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Records in `health` that a part was used with this result. Returns `error`.
int rig_part_used(struct rig *self, enum rig_part part, int error);

/// The same for the bridge, and on an error sets `last_error` as rig_bus_failed does. Returns
/// `error`.
int rig_bridge_used(struct rig *self, int error);

#ifdef __cplusplus
}
#endif

#endif

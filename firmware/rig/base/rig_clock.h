// SPDX-License-Identifier: Apache-2.0
/// The rig's clock. For rig/ only.
#ifndef VERGENCE_RIG_BASE_CLOCK_H
#define VERGENCE_RIG_BASE_CLOCK_H

#include "core/invariant.h"
#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The present time of the rig's clock, in us.
static inline uint64_t rig_now_us(const struct rig *self) {
    INVARIANT(self->ports.clock != NULL);
    return self->ports.clock->operations->now_us(self->ports.clock->self);
}

#ifdef __cplusplus
}
#endif

#endif

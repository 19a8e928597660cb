// SPDX-License-Identifier: Apache-2.0
#include "rig/base/health.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"

int rig_part_used(struct rig *self, enum rig_part part, int error) {
    INVARIANT((unsigned)part < RIG_PARTS && error <= ERROR_OK);
    struct rig_part_health *health = &self->health[part];
    health->uses++;
    health->error = error;
    if (error == ERROR_OK) {
        health->present = true;
        health->last_us = rig_now_us(self);
    } else {
        health->failures++;
    }
    return error;
}

int rig_bridge_used(struct rig *self, int error) {
    rig_part_used(self, RIG_PART_BRIDGE, error);
    return error == ERROR_OK ? ERROR_OK : rig_bus_failed(self, RIG_PART_BRIDGE, error);
}

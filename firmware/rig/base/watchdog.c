// SPDX-License-Identifier: Apache-2.0
#include "rig/base/watchdog.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"

enum {
    US_PER_MS = 1000,
    // A feed may be late by a repeated transfer, and three of four may be lost.
    FEEDS_PER_PERIOD = 4,
};

static bool feed_is_due(const struct rig *self, uint64_t now_us) {
    const bool alive = self->profile.bridge && self->state == RIG_READY;
    const uint64_t period_us = (uint64_t)self->profile.watchdog_ms * US_PER_MS;
    return alive && period_us > 0 && now_us - self->fed_us >= period_us / FEEDS_PER_PERIOD;
}

void rig_watchdog_fed(struct rig *self) {
    if (self->state != RIG_READY) {
        return;  // nothing moves, so there is no deadline
    }
    const uint64_t now_us = self->health[RIG_PART_BRIDGE].last_us;
    const uint64_t before_us = self->feed_arrived_us;
    INVARIANT(now_us >= before_us);
    if (before_us != 0 && now_us - before_us > self->feed_gap_us) {
        self->feed_gap_us = now_us - before_us;
    }
    self->feed_arrived_us = now_us;
}

int rig_watchdog_feed(struct rig *self) {
    const uint64_t now_us = rig_now_us(self);
    if (!feed_is_due(self, now_us)) {
        return ERROR_OK;
    }
    const int error =
        rig_part_used(self, RIG_PART_BRIDGE, fpga_bridge_watchdog_feed(&self->bridge));
    if (error != ERROR_OK) {
        self->state = RIG_SAFE;
        self->bridge_lost = true;
        return rig_part_failed(self, RIG_PART_BRIDGE, error,
                               error == ERROR_RESTARTED
                                   ? "it has restarted and lost its settings (run bringup)"
                                   : "it does not accept the watchdog's feed (check its supply and "
                                     "I2C lines, then run bringup)");
    }
    self->fed_us = now_us;
    rig_watchdog_fed(self);
    return ERROR_OK;
}

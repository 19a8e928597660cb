// SPDX-License-Identifier: Apache-2.0
#include "rig/base/poll.h"

#include "core/error.h"
#include "rig/base/rig_clock.h"
#include "rig/base/watchdog.h"

int rig_poll_observer(const struct rig *self) {
    const struct rig_observer *observer = &self->observer;
    const bool stop = observer->should_stop != NULL && observer->should_stop(observer->self);
    return stop ? ERROR_CANCELLED : ERROR_OK;
}

int rig_poll(struct rig *self) {
    const int error = rig_watchdog_feed(self);
    return error != ERROR_OK ? error : rig_poll_observer(self);
}

int rig_wait_until(struct rig *self, uint64_t until_us) {
    const struct hal_clock *clock = self->ports.clock;
    for (uint64_t now_us; (now_us = rig_now_us(self)) < until_us;) {
        const int error = rig_poll(self);
        if (error != ERROR_OK) {
            return error;
        }
        const uint64_t step_us =
            until_us - now_us < RIG_POLL_US ? until_us - now_us : (uint64_t)RIG_POLL_US;
        clock->operations->wait_until_us(clock->self, now_us + step_us);
    }
    return ERROR_OK;
}

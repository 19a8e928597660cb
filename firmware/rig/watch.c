// SPDX-License-Identifier: Apache-2.0
#include "rig/watch.h"

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

enum {
    US_PER_MS = 1000,
    // A feed may be late by a repeated transfer, and three of four may be lost.
    FEEDS_PER_PERIOD = 4,
};

uint64_t watch_now_us(const struct rig *self) {
    INVARIANT(self->ports.clock != NULL);
    return self->ports.clock->operations->now_us(self->ports.clock->self);
}

static bool feed_is_due(const struct rig *self, uint64_t now_us) {
    const bool alive = self->profile.bridge && self->state == RIG_READY;
    const uint64_t period_us = (uint64_t)self->profile.watchdog_ms * US_PER_MS;
    return alive && period_us > 0 && now_us - self->fed_us >= period_us / FEEDS_PER_PERIOD;
}

void watch_fed(struct rig *self) {
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

int watch_feed(struct rig *self) {
    const uint64_t now_us = watch_now_us(self);
    if (!feed_is_due(self, now_us)) {
        return ERROR_OK;
    }
    const int error = watch_used(self, RIG_PART_BRIDGE, fpga_bridge_watchdog_feed(&self->bridge));
    if (error != ERROR_OK) {
        self->state = RIG_SAFE;
        self->bridge_lost = true;
        return watch_failed(self, RIG_PART_BRIDGE, error,
                            error == ERROR_RESTARTED
                                ? "it has restarted and lost its settings (run bringup)"
                                : "it does not accept the watchdog's feed (check its supply and "
                                  "I2C lines, then run bringup)");
    }
    self->fed_us = now_us;
    watch_fed(self);
    return ERROR_OK;
}

int watch_look(struct rig *self) {
    const int error = watch_feed(self);
    if (error != ERROR_OK) {
        return error;
    }
    const struct rig_observer *observer = &self->observer;
    const bool stop = observer->should_stop != NULL && observer->should_stop(observer->self);
    return stop ? ERROR_CANCELLED : ERROR_OK;
}

int watch_until(struct rig *self, uint64_t until_us) {
    const struct hal_clock *clock = self->ports.clock;
    for (uint64_t now_us; (now_us = watch_now_us(self)) < until_us;) {
        const int error = watch_look(self);
        if (error != ERROR_OK) {
            return error;
        }
        const uint64_t step_us =
            until_us - now_us < WATCH_STEP_US ? until_us - now_us : (uint64_t)WATCH_STEP_US;
        clock->operations->wait_until_us(clock->self, now_us + step_us);
    }
    return ERROR_OK;
}

int watch_used(struct rig *self, enum rig_part part, int error) {
    INVARIANT((unsigned)part < RIG_PARTS && error <= ERROR_OK);
    struct rig_part_health *health = &self->health[part];
    health->uses++;
    health->error = error;
    if (error == ERROR_OK) {
        health->present = true;
        health->last_us = watch_now_us(self);
    } else {
        health->failures++;
    }
    return error;
}

// A message under construction, limited to the size of its buffer.
struct sentence {
    char *text;
    size_t length;
};

static void add(struct sentence *sentence, const char *text) {
    const size_t room = sizeof((struct rig_error *)0)->text - 1;
    while (*text != '\0' && sentence->length < room) {
        sentence->text[sentence->length++] = *text++;
    }
    INVARIANT(sentence->length <= room);
    sentence->text[sentence->length] = '\0';
}

static int write_error(struct rig_error *last_error, enum rig_part part, int error,
                       const char *what, const int32_t *numbers) {
    INVARIANT(error < ERROR_OK);
    struct sentence sentence = {last_error->text, 0};
    last_error->part = part;
    last_error->error = error;
    add(&sentence, rig_part_text(part));
    add(&sentence, ": ");
    for (; *what != '\0'; what++) {
        char piece[DECIMAL_TEXT_BYTES] = {*what, '\0'};
        // Without numbers # is an ordinary character: the name of a device may contain it.
        if (*what == '#' && numbers != NULL) {
            decimal_print(*numbers++, 0, piece);
        }
        add(&sentence, piece);
    }
    return error;
}

int watch_error(struct rig *self, enum rig_part part, int error, const char *what,
                const int32_t *numbers) {
    return write_error(&self->last_error, part, error, what, numbers);
}

int watch_failed(struct rig *self, enum rig_part part, int error, const char *what) {
    const struct rig_devices *devices = self->ports.devices;
    const char *missing = devices == NULL ? NULL : devices->missing(devices->self, part);
    return watch_error(self, part, error, missing != NULL ? missing : what, NULL);
}

int watch_rejection(struct rig *self, enum rig_part part, int error, const char *what,
                    const int32_t *numbers) {
    return write_error(&self->rejected, part, error, what, numbers);
}

// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/sim/sim_clock.h"

static uint64_t now_us(void *self) {
    struct sim_connection *connection = self;
    sim_connection_ask_time(connection);  // if it has gone, the last known time remains
    return connection->now_us;
}

static void wait_until_us(void *self, uint64_t time_us) {
    struct sim_connection *connection = self;
    // The last known time may be old, but is never ahead.
    if (time_us > connection->now_us) {
        sim_connection_advance(connection, time_us, 0, NULL);
    }
}

struct hal_clock sim_clock_hal(struct sim_connection *connection) {
    static const struct hal_clock_operations operations = {now_us, wait_until_us};
    return (struct hal_clock){&operations, connection};
}

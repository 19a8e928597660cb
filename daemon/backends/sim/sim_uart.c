// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/sim/sim_uart.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

// Writes take no simulated time, so the deadline cannot pass.
static int write_bytes(void *context, const void *data, size_t bytes, uint64_t deadline_us) {
    struct sim_uart *self = context;
    (void)deadline_us;
    const uint8_t *next = data;
    int error = ERROR_OK;
    while (bytes > 0 && error == ERROR_OK) {
        const size_t part = bytes < SIMRIG_SERIAL_BYTES_MAX ? bytes : SIMRIG_SERIAL_BYTES_MAX;
        struct sim_exchange request = {.type = SIMRIG_SERIAL_WRITE, .body = next, .bytes = part};
        error = sim_connection_require(self->connection, &request);
        next += part;
        bytes -= part;
    }
    return error;
}

// Appends newly received bytes to the pending ones.
static int fetch(struct sim_uart *self) {
    INVARIANT(self->pending_bytes <= sizeof self->pending);
    struct sim_exchange request = {.type = SIMRIG_SERIAL_READ,
                                   .rest = self->pending + self->pending_bytes,
                                   .rest_capacity = sizeof self->pending - self->pending_bytes};
    const int error = sim_connection_require(self->connection, &request);
    if (error == ERROR_OK) {
        self->pending_bytes += request.rest_bytes;
    }
    return error;
}

static int read_bytes(void *context, void *data, size_t capacity, uint64_t deadline_us,
                      size_t *bytes) {
    struct sim_uart *self = context;
    INVARIANT(capacity > 0);
    for (;;) {
        uint32_t woken = 0;
        int error = self->pending_bytes > 0 ? ERROR_OK : fetch(self);
        if (error == ERROR_OK && self->pending_bytes > 0) {
            const size_t part = self->pending_bytes < capacity ? self->pending_bytes : capacity;
            memcpy(data, self->pending, part);
            self->pending_bytes -= part;
            memmove(self->pending, self->pending + part, self->pending_bytes);
            *bytes = part;
            return ERROR_OK;
        }
        if (error == ERROR_OK) {
            error =
                sim_connection_advance(self->connection, deadline_us, SIMRIG_WAKE_SERIAL, &woken);
        }
        if (error != ERROR_OK) {
            return error;
        }
        // Also woken when the controller received a byte: it need not answer.
        if (woken == 0) {
            return ERROR_TIMEOUT;
        }
    }
}

static int discard(void *context) {
    struct sim_uart *self = context;
    self->pending_bytes = 0;
    const int error = fetch(self);
    self->pending_bytes = 0;
    return error;
}

struct hal_uart sim_uart_hal(struct sim_uart *self) {
    static const struct hal_uart_operations operations = {write_bytes, read_bytes, discard};
    return (struct hal_uart){&operations, self};
}

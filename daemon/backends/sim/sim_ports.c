// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/sim/sim_ports.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/sim/sim_bytes.h"

// ---- clock

static uint64_t now_us(void *self) {
    struct sim_connection *connection = self;
    sim_connection_ask_time(connection);  // keeps the last known time if the rig has gone
    return connection->now_us;
}

static void wait_until_us(void *self, uint64_t time_us) {
    struct sim_connection *connection = self;
    // The last known time may be old, but is never ahead.
    if (time_us > connection->now_us) {
        sim_connection_advance(connection, time_us, 0, NULL);
    }
}

/// In virtual time nothing becomes due between commands, so that the same commands make the same
/// calls. In real time something is, once whenever the instrument idles. Which of them it is, is
/// known once the rig has answered.
static bool idle_is_due(void *self) {
    struct sim_connection *connection = self;
    connection->idled = connection->wall && !connection->idled;
    return connection->idled;
}

struct hal_clock sim_clock_hal(struct sim_connection *connection) {
    static const struct hal_clock_operations operations = {now_us, wait_until_us, idle_is_due};
    return (struct hal_clock){&operations, connection};
}

// ---- I2C

enum {
    TRANSFER_HEAD = 6,
    MESSAGE_HEAD = 4,
    REPLY_HEAD = 4,
    BODY_MAX = TRANSFER_HEAD + HAL_I2C_MESSAGES_MAX * (MESSAGE_HEAD + HAL_I2C_BYTES_MAX),
};

static int error_of(int32_t status) {
    switch (status) {
        case SIMRIG_OK:
            return ERROR_OK;
        case SIMRIG_I2C_NACK_ADDRESS:
        case SIMRIG_I2C_NACK_DATA:
            return ERROR_I2C_NACK;
        case SIMRIG_I2C_ARBITRATION:
            return ERROR_I2C_ARBITRATION;
        case SIMRIG_I2C_TIMEOUT:
            return ERROR_TIMEOUT;
        case SIMRIG_I2C_STUCK:
            return ERROR_I2C_STUCK;
        default:
            return ERROR_IO;
    }
}

size_t sim_i2c_begun(int32_t status, const struct hal_i2c_message *messages, size_t count,
                     size_t whole, size_t bytes) {
    INVARIANT(whole <= count);
    size_t before = 0, all = 0;
    for (size_t i = 0; i < count; i++) {
        before += i < whole ? 1u + messages[i].bytes : 0;
        all += 1u + messages[i].bytes;
    }
    if (status == SIMRIG_I2C_STUCK) {
        return 0;  // the lines were checked before START
    }
    if (status == SIMRIG_I2C_NACK_ADDRESS) {
        return before < all ? before + 1 : all;
    }
    // The address, the complete bytes and the current one. Fewer if it was lost earlier, in a START
    // or an address.
    const size_t max = before + 1 + bytes + 1;
    return status == SIMRIG_OK || max > all ? all : max;
}

static size_t write_request(uint8_t *body, const struct hal_i2c_message *messages, size_t count,
                            uint32_t speed_hz) {
    sim_bytes_put_u32(body, speed_hz);
    sim_bytes_put_u16(body + 4, (uint16_t)count);
    size_t at = TRANSFER_HEAD;
    for (size_t i = 0; i < count; i++) {
        const struct hal_i2c_message *message = &messages[i];
        INVARIANT(message->bytes >= 1 && message->bytes <= HAL_I2C_BYTES_MAX);
        body[at] = message->address;
        body[at + 1] = message->read ? SIMRIG_I2C_READ : 0;
        sim_bytes_put_u16(body + at + 2, message->bytes);
        at += MESSAGE_HEAD;
        if (!message->read) {
            memcpy(body + at, message->data, message->bytes);
            at += message->bytes;
        }
    }
    return at;
}

// False: not the requested number of bytes.
static bool take_reads(const struct hal_i2c_message *messages, size_t count, const uint8_t *bytes,
                       size_t available) {
    size_t at = 0;
    for (size_t i = 0; i < count; i++) {
        if (messages[i].read) {
            if (available - at < messages[i].bytes) {
                return false;
            }
            memcpy(messages[i].data, bytes + at, messages[i].bytes);
            at += messages[i].bytes;
        }
    }
    return at == available;
}

static int transfer(void *context, const struct hal_i2c_message *messages, size_t count,
                    uint64_t deadline_us, size_t *begun) {
    struct sim_i2c *self = context;
    INVARIANT(count >= 1 && count <= HAL_I2C_MESSAGES_MAX);
    uint8_t body[BODY_MAX], head[REPLY_HEAD], reads[HAL_I2C_MESSAGES_MAX * HAL_I2C_BYTES_MAX];
    struct sim_exchange exchange = {
        .type = SIMRIG_I2C,
        .body = body,
        .bytes = write_request(body, messages, count, self->speed_hz),
        .head = head,
        .head_bytes = sizeof head,
        .rest = reads,
        .rest_capacity = sizeof reads,
    };
    *begun = sim_i2c_begun(SIMRIG_OK, messages, count, count, 0);
    int error = sim_connection_run(self->connection, &exchange);
    if (error != ERROR_OK) {
        return error;
    }
    error = error_of(exchange.status);
    if (error == ERROR_IO) {
        return error;
    }
    const size_t whole = sim_bytes_u16(head);
    if (whole > count ||
        (error == ERROR_OK && !take_reads(messages, count, reads, exchange.rest_bytes))) {
        return ERROR_IO;
    }
    *begun = sim_i2c_begun(exchange.status, messages, count, whole, sim_bytes_u16(head + 2));
    if (error == ERROR_OK) {
        error = sim_connection_ask_time(self->connection);
        if (error == ERROR_OK && self->connection->now_us > deadline_us) {
            error = ERROR_TIMEOUT;
        }
    }
    return error;
}

struct hal_i2c sim_i2c_hal(struct sim_i2c *self) {
    static const struct hal_i2c_operations operations = {transfer, NULL};
    return (struct hal_i2c){&operations, self};
}

// ---- GPIO

enum { GPIO_REPLY_HEAD = 8 };

static int set_line(void *context, enum hal_gpio_line line, bool active) {
    struct sim_gpio *self = context;
    if (line != HAL_GPIO_BRIDGE_RESET) {
        return ERROR_UNSUPPORTED;
    }
    const uint32_t outputs = active ? SIMRIG_OUT_BRIDGE_RESET : 0;
    uint8_t body[4];
    sim_bytes_put_u32(body, outputs);
    struct sim_exchange request = {.type = SIMRIG_GPIO_SET, .body = body, .bytes = sizeof body};
    const int error = sim_connection_require(self->connection, &request);
    if (error == ERROR_OK) {
        self->outputs = outputs;
    }
    return error;
}

static int get_line(void *context, enum hal_gpio_line line, bool *active) {
    struct sim_gpio *self = context;
    if (line == HAL_GPIO_BRIDGE_RESET) {
        *active = (self->outputs & SIMRIG_OUT_BRIDGE_RESET) != 0;
        return ERROR_OK;
    }
    if (line != HAL_GPIO_BRIDGE_IRQ) {
        return ERROR_UNSUPPORTED;
    }
    // The reply's edges do not fit and are dropped.
    uint8_t head[GPIO_REPLY_HEAD];
    struct sim_exchange request = {
        .type = SIMRIG_GPIO_GET, .head = head, .head_bytes = sizeof head};
    const int error = sim_connection_require(self->connection, &request);
    if (error == ERROR_OK) {
        *active = (sim_bytes_u32(head) & SIMRIG_IN_IRQ) != 0;
    }
    return error;
}

struct hal_gpio sim_gpio_hal(struct sim_gpio *self) {
    static const struct hal_gpio_operations operations = {set_line, get_line};
    return (struct hal_gpio){&operations, self};
}

// ---- serial line

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
static int fetch_bytes(struct sim_uart *self) {
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
        int error = self->pending_bytes > 0 ? ERROR_OK : fetch_bytes(self);
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

static int discard_bytes(void *context) {
    struct sim_uart *self = context;
    self->pending_bytes = 0;
    const int error = fetch_bytes(self);
    self->pending_bytes = 0;
    return error;
}

struct hal_uart sim_uart_hal(struct sim_uart *self) {
    static const struct hal_uart_operations operations = {write_bytes, read_bytes, discard_bytes};
    return (struct hal_uart){&operations, self};
}

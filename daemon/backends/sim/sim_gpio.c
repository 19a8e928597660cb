// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/sim/sim_gpio.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/sim/sim_bytes.h"

enum {
    REPLY_HEAD = 8,
    EDGE_BYTES = 10,
    EDGES_MAX = 4096,  // kept by the rig
    IRQ_LINE = 0,      // its line number in edge records
};

static int set(void *context, enum hal_gpio_line line, bool active) {
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

static void drop_oldest(struct sim_gpio *self) {
    INVARIANT(self->edge_count > 0);
    self->edge_count--;
    memmove(self->edges_us, self->edges_us + 1, self->edge_count * sizeof self->edges_us[0]);
}

// Reads the levels, and keeps the edges to active in the reply.
static int ask(struct sim_gpio *self, uint32_t *levels) {
    uint8_t head[REPLY_HEAD], edges[EDGES_MAX * EDGE_BYTES];
    struct sim_exchange request = {.type = SIMRIG_GPIO_GET,
                                   .head = head,
                                   .head_bytes = sizeof head,
                                   .rest = edges,
                                   .rest_capacity = sizeof edges};
    const int error = sim_connection_require(self->connection, &request);
    if (error != ERROR_OK) {
        return error;
    }
    const size_t count = sim_bytes_u32(head + 4);
    // Checked first: in 32 bits, count * EDGE_BYTES could overflow.
    if (count > EDGES_MAX || request.rest_bytes != count * EDGE_BYTES) {
        return ERROR_IO;
    }
    for (size_t i = 0; i < count; i++) {
        const uint8_t *edge = edges + i * EDGE_BYTES;
        if (edge[8] == IRQ_LINE && edge[9] != 0) {
            if (self->edge_count == SIM_GPIO_EDGES) {
                drop_oldest(self);
            }
            self->edges_us[self->edge_count++] = sim_connection_reported_us(self->connection, edge);
        }
    }
    *levels = sim_bytes_u32(head);
    return ERROR_OK;
}

static int get(void *context, enum hal_gpio_line line, bool *active) {
    struct sim_gpio *self = context;
    if (line == HAL_GPIO_BRIDGE_RESET) {
        *active = (self->outputs & SIMRIG_OUT_BRIDGE_RESET) != 0;
        return ERROR_OK;
    }
    if (line != HAL_GPIO_BRIDGE_IRQ) {
        return ERROR_UNSUPPORTED;
    }
    uint32_t levels = 0;
    const int error = ask(self, &levels);
    if (error == ERROR_OK) {
        *active = (levels & SIMRIG_IN_IRQ) != 0;
    }
    return error;
}

static int wait_edge(void *context, enum hal_gpio_line line, uint64_t deadline_us,
                     uint64_t *time_us) {
    struct sim_gpio *self = context;
    if (line != HAL_GPIO_BRIDGE_IRQ) {
        return ERROR_UNSUPPORTED;
    }
    for (;;) {
        uint32_t levels = 0, woken = 0;
        int error = ask(self, &levels);
        if (error == ERROR_OK && self->edge_count > 0) {
            *time_us = self->edges_us[0];
            drop_oldest(self);
            return ERROR_OK;
        }
        if (error == ERROR_OK) {
            error = sim_connection_advance(self->connection, deadline_us, SIMRIG_WAKE_GPIO, &woken);
        }
        if (error != ERROR_OK) {
            return error;
        }
        if (woken == 0) {
            return ERROR_TIMEOUT;
        }
    }
}

struct hal_gpio sim_gpio_hal(struct sim_gpio *self) {
    static const struct hal_gpio_operations operations = {set, get, wait_edge};
    return (struct hal_gpio){&operations, self};
}

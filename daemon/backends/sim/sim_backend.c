// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/sim/sim_backend.h"

#include <stdio.h>
#include <string.h>

#include "core/error.h"

enum {
    BUS_SPEED_HZ = 400000,
    LISTENER_MS = 10000,  ///< a program that was just started, on a slow disk
    ANSWER_MS = SIM_CONNECTION_TIMEOUT_MS,
};

// Reports the progress; false: cancelled.
static bool go_on_waiting(void *opaque, int64_t waited_ms) {
    const struct rig_observer *observer = opaque;
    if (observer->progress != NULL) {
        observer->progress(observer->self, "waiting for the simulated rig",
                           (uint32_t)(waited_ms / 1000), ANSWER_MS / 1000);
    }
    return observer->should_stop == NULL || !observer->should_stop(observer->self);
}

// State of the previous rig does not apply to the next one.
static void look_for_rig(void *opaque, const struct rig_observer *observer) {
    struct sim_backend *self = opaque;
    if (sim_connection_gone(&self->connection)) {
        struct rig_observer observing = *observer;
        const struct sim_wait wait = {.listener_ms = LISTENER_MS,
                                      .answer_ms = ANSWER_MS,
                                      .go_on = go_on_waiting,
                                      .self = &observing};
        sim_connection_renew(&self->connection, self->where, SIMRIG_ROLE_BOARD, &wait);
        self->camera_state.armed = false;
        self->gpio_state.outputs = 0;
    }
}

static const char *missing(void *opaque, enum rig_part part) {
    struct sim_backend *self = opaque;
    (void)part;
    return self->connection.socket < 0 ? self->connection.text : NULL;
}

int sim_backend_open(struct sim_backend *self, const char *where, int timeout_ms) {
    if (strlen(where) >= sizeof self->where) {
        self->connection = (struct sim_connection){.socket = -1};
        snprintf(self->connection.text, sizeof self->connection.text, "the address is too long");
        return ERROR_ARGUMENT;
    }
    strcpy(self->where, where);
    self->devices = (struct rig_devices){.open = look_for_rig, .missing = missing, .self = self};
    const int error = sim_connection_open(&self->connection, where, SIMRIG_ROLE_BOARD, timeout_ms);
    self->camera_state = (struct sim_camera){
        .connection = &self->connection, .max_px = (size_t)MT9T001_WIDTH_PX * MT9T001_HEIGHT_PX};
    self->i2c_state = (struct sim_i2c){&self->connection, BUS_SPEED_HZ};
    self->gpio_state = (struct sim_gpio){.connection = &self->connection};
    self->uart_state = (struct sim_uart){.connection = &self->connection};
    self->clock = sim_clock_hal(&self->connection);
    self->i2c = sim_i2c_hal(&self->i2c_state);
    self->camera = sim_camera_hal(&self->camera_state);
    self->gpio = sim_gpio_hal(&self->gpio_state);
    self->uart = sim_uart_hal(&self->uart_state);
    return error;
}

void sim_backend_close(struct sim_backend *self) {
    sim_connection_close(&self->connection);
}

struct rig_ports sim_backend_ports(const struct sim_backend *self) {
    return (struct rig_ports){.clock = &self->clock,
                              .i2c = &self->i2c,
                              .gpio = &self->gpio,
                              .camera = {&self->camera, &self->camera},
                              .lens_uart = &self->uart,
                              .devices = &self->devices};
}

// SPDX-License-Identifier: Apache-2.0
// Arducam's controller of a motorized zoom lens, on I2C. Its registers of 16 bits, high byte first,
// are those of the maker's public code (ArduCAM/PTZ-Camera-Controller, Focuser.py):
//
//   0x00 zoom, 0x01 focus   written: moves there; read: the last position written
//   0x04                    not 0 while a motor runs
//
// The steppers have no position sensors, so a jam is not noticed. Assumed, as no manual is public:
// it knows the positions after power-up, and a command while a motor runs may be lost (moves repeat
// a command that had no effect).
#include "core/error.h"
#include "core/invariant.h"
#include "device/lens_driver.h"

enum {
    BUSY = 0x04,  // LENS_ZOOM and LENS_FOCUS are the registers of the positions
    WORD_BYTES = 2,
    MOTORS = 2,
    POLL_US = 10000,  // same interval as in the public code
    TRANSFER_US = 25000,
    TRIES = 3,
};

struct lens_arducam {
    uint64_t polled_us, last_rx_us;
};
_Static_assert(sizeof(struct lens_arducam) <= LENS_STATE_BYTES, "the state does not fit");

static uint64_t now_us(const struct lens_controller *self) {
    return self->ports.clock->operations->now_us(self->ports.clock->self);
}

static int transfer(const struct lens_controller *self, const struct hal_i2c_message *messages,
                    size_t count) {
    const struct hal_i2c *bus = self->ports.i2c;
    size_t begun = 0;
    INVARIANT(count >= 1 && count <= HAL_I2C_MESSAGES_MAX);
    return bus->operations->transfer(bus->self, messages, count, now_us(self) + TRANSFER_US,
                                     &begun);
}

static int read_register(const struct lens_controller *self, uint8_t index, uint16_t *value) {
    uint8_t word[WORD_BYTES] = {0, 0};
    const uint8_t address = self->settings->address;
    const struct hal_i2c_message messages[] = {
        {.data = &index, .bytes = sizeof index, .address = address},
        {.data = word, .bytes = sizeof word, .address = address, .read = true},
    };
    const int error = transfer(self, messages, sizeof messages / sizeof messages[0]);
    *value = (uint16_t)(word[0] << 8 | word[1]);
    return error;
}

static int read_all(struct lens_controller *self, struct lens_reading *readings) {
    struct lens_arducam *state = (void *)self->state.bytes;
    uint16_t busy = 0;
    state->polled_us = now_us(self);
    int error = read_register(self, BUSY, &busy);
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        uint16_t position = 0;
        if (axis < MOTORS && error == ERROR_OK) {
            error = read_register(self, (uint8_t)axis, &position);
        }
        readings[axis] = (struct lens_reading){
            .position = position,
            .moving = busy != 0,
            .time_us = state->polled_us,
            .sampled_us = state->polled_us,
        };
    }
    state->last_rx_us = error == ERROR_OK ? now_us(self) : state->last_rx_us;
    return error;
}

static int open(struct lens_controller *self, unsigned lens, uint64_t deadline_us) {
    struct lens_reading readings[LENS_AXES];
    const int error = read_all(self, readings);
    (void)lens;
    (void)deadline_us;
    const int32_t max = self->driver->position_max;
    const bool other = readings[LENS_ZOOM].position > max || readings[LENS_FOCUS].position > max;
    return error == ERROR_OK && other ? ERROR_DEVICE : error;
}

// A transfer that failed is repeated by the next call, up to the caller's time limit.
static int read(struct lens_controller *self, unsigned lens, uint64_t deadline_us,
                struct lens_reading *readings) {
    const struct lens_arducam *state = (const void *)self->state.bytes;
    const struct hal_clock *clock = self->ports.clock;
    const uint64_t due_us = state->polled_us + POLL_US;
    (void)lens;
    if (now_us(self) < due_us && now_us(self) < deadline_us) {
        clock->operations->wait_until_us(clock->self, due_us < deadline_us ? due_us : deadline_us);
    }
    if (now_us(self) < due_us) {
        return ERROR_TIMEOUT;
    }
    const int error = read_all(self, readings);
    return error == ERROR_OK || error == ERROR_DEVICE ? error : ERROR_TIMEOUT;
}

static int go_to_position(struct lens_controller *self, unsigned lens, enum lens_axis axis,
                          int32_t position, uint64_t deadline_us) {
    uint8_t bytes[] = {(uint8_t)axis, (uint8_t)(position >> 8), (uint8_t)position};
    const struct hal_i2c_message message = {
        .data = bytes, .bytes = sizeof bytes, .address = self->settings->address};
    int error = ERROR_TIMEOUT;
    INVARIANT(lens == 0 && (unsigned)axis < MOTORS && position >= 0 && position <= UINT16_MAX);
    for (int i = 0; i < TRIES && error != ERROR_OK && now_us(self) < deadline_us; i++) {
        error = transfer(self, &message, 1);
    }
    return error;
}

static uint64_t last_rx(const struct lens_controller *self) {
    const struct lens_arducam *state = (const void *)self->state.bytes;
    return state->last_rx_us;
}

const struct lens_operations lens_arducam_operations = {
    .open = open, .go = go_to_position, .read = read, .last_rx = last_rx};

// SPDX-License-Identifier: Apache-2.0
#include "device/fpga_bridge_bus.h"

#include "core/error.h"
#include "core/invariant.h"
#include "device/i2c_recovery.h"

void fpga_bridge_bus_init(struct fpga_bridge_bus *self, const struct hal_i2c *bus,
                          const struct hal_clock *clock) {
    INVARIANT(bus != NULL && bus->operations->transfer != NULL && clock != NULL);
    *self = (struct fpga_bridge_bus){.bus = bus, .clock = clock};
}

static uint64_t now_us(const struct fpga_bridge_bus *self) {
    return self->clock->operations->now_us(self->clock->self);
}

static size_t bytes_of(const struct fpga_bridge_job *job) {
    size_t bytes = 0;
    for (size_t i = 0; i < job->count; i++) {
        INVARIANT(job->messages[i].bytes >= 1 && job->messages[i].bytes <= HAL_I2C_BYTES_MAX);
        bytes += 1 + job->messages[i].bytes;
    }
    return bytes;
}

// Whether the bridge may have left an otherwise successful transfer.
static bool is_doubtful(const struct fpga_bridge_job *job) {
    const uint8_t *bytes = job->guarded;
    if (bytes == NULL) {
        return false;
    }
    INVARIANT(job->guarded_bytes >= 4);
    const size_t last = job->guarded_bytes - 1;
    const unsigned first_word = (unsigned)bytes[0] << 8 | bytes[1];
    return first_word == job->lost_index || (bytes[last - 1] & bytes[last]) == 0xFF;
}

// One attempt; `*begun` as in hal_i2c.
static int attempt(struct fpga_bridge_bus *self, const struct fpga_bridge_job *job, size_t *begun) {
    const uint64_t deadline_us = now_us(self) + FPGA_BRIDGE_TRANSFER_US;
    *begun = bytes_of(job);
    const int error = self->bus->operations->transfer(self->bus->self, job->messages, job->count,
                                                      deadline_us, begun);
    if (error != ERROR_OK) {
        return error == ERROR_I2C_NACK && job->refusable_byte != 0 && *begun == job->refusable_byte
                   ? ERROR_REFUSED
                   : error;
    }
    *begun = bytes_of(job);
    if (now_us(self) > deadline_us) {
        return ERROR_TIMEOUT;
    }
    if (job->read_back != NULL) {
        const unsigned word = (unsigned)job->read_back[0] << 8 | job->read_back[1];
        return (word & job->mask) == job->expected ? ERROR_OK : ERROR_VERIFY;
    }
    return ERROR_OK;
}

// The counter for the result of an attempt.
static uint32_t *count_of(struct fpga_bridge_counts *counts, int error) {
    switch (error) {
        case ERROR_OK:
            return &counts->transfers;
        case ERROR_I2C_NACK:
            return &counts->nacks;
        case ERROR_I2C_ARBITRATION:
            return &counts->arbitration;
        case ERROR_TIMEOUT:
            return &counts->timeouts;
        case ERROR_I2C_STUCK:
            return &counts->stuck;
        case ERROR_VERIFY:
            return &counts->verify;
        case ERROR_REFUSED:
            return &counts->refused;
        default:
            return &counts->other_errors;
    }
}

static int recover(struct fpga_bridge_bus *self) {
    self->counts.recoveries++;
    const int error = i2c_recovery_run(self->bus, self->clock, FPGA_BRIDGE_QUIET_US);
    self->counts.unrecovered += error != ERROR_OK;
    return error;
}

// Whether a repetition may help after this error.
static bool may_pass(int error) {
    return i2c_recovery_is_due(error) || error == ERROR_I2C_NACK || error == ERROR_VERIFY ||
           error == ERROR_REFUSED;
}

int fpga_bridge_bus_run(struct fpga_bridge_bus *self, const struct fpga_bridge_job *job) {
    INVARIANT(self->bus != NULL && self->clock != NULL);
    INVARIANT(job->count >= 1 && job->count <= HAL_I2C_MESSAGES_MAX);
    INVARIANT((job->expected & ~job->mask) == 0);
    int error = ERROR_OK;
    bool doubted = false;
    for (int attempts = 0; attempts < FPGA_BRIDGE_ATTEMPTS; attempts++) {
        size_t begun = 0;
        self->counts.repeats += attempts > 0;
        error = attempt(self, job, &begun);
        const bool doubtful = error == ERROR_OK && is_doubtful(job);
        if (doubtful && !doubted) {
            error = ERROR_VERIFY;
            self->counts.doubts++;
        } else {
            ++*count_of(&self->counts, error);
        }
        doubted = doubtful;
        if (i2c_recovery_is_due(error)) {
            const int stuck = recover(self);
            if (stuck != ERROR_OK) {
                return stuck;
            }
        }
        if (!may_pass(error) || begun > job->repeatable_bytes) {
            return error;
        }
    }
    INVARIANT(error != ERROR_OK);
    return error;
}

// SPDX-License-Identifier: Apache-2.0
#include "device/fpga_bridge_event.h"

#include "core/error.h"
#include "core/invariant.h"

int fpga_bridge_event_enable(struct fpga_bridge *self, uint16_t events) {
    return fpga_bridge_write(self, BRIDGE_IRQ_ENABLE, events);
}

int fpga_bridge_event_take(struct fpga_bridge *self, uint16_t *events) {
    const struct bridge_register *row = fpga_bridge_register(BRIDGE_IRQ_STATUS);
    INVARIANT(row != NULL && row->clear_mask != 0 && row->stored_mask == 0);
    uint16_t seen = 0;
    const int error = fpga_bridge_read(self, BRIDGE_IRQ_STATUS, &seen);
    if (error != ERROR_OK) {
        return error;
    }
    seen &= row->clear_mask;
    *events = seen;
    return seen == 0 ? ERROR_OK : fpga_bridge_clear(self, BRIDGE_IRQ_STATUS, seen);
}

int fpga_bridge_event_test(struct fpga_bridge *self, uint16_t events) {
    return fpga_bridge_start(self, BRIDGE_IRQ_TEST, events);
}

int fpga_bridge_event_status(struct fpga_bridge *self, uint16_t *status) {
    return fpga_bridge_read(self, BRIDGE_STATUS, status);
}

int fpga_bridge_event_counts_read(struct fpga_bridge *self, struct fpga_bridge_event_counts *out) {
    enum { WORDS = BRIDGE_SPIKES - BRIDGE_I2C_TIMEOUTS + 1 };
    _Static_assert((int)WORDS <= (int)FPGA_BRIDGE_BLOCK_WORDS, "one transfer");
    INVARIANT(out != NULL);
    uint16_t words[WORDS];
    const int error = fpga_bridge_read_block(self, BRIDGE_I2C_TIMEOUTS, WORDS, words);
    if (error == ERROR_OK) {
        *out = (struct fpga_bridge_event_counts){
            .timeouts = words[0],
            .protocol_errors = words[BRIDGE_I2C_PROTOCOL_ERRORS - BRIDGE_I2C_TIMEOUTS],
            .branch_errors = words[BRIDGE_BRANCH_ERRORS - BRIDGE_I2C_TIMEOUTS],
            .spikes = words[BRIDGE_SPIKES - BRIDGE_I2C_TIMEOUTS],
        };
    }
    return error;
}

int fpga_bridge_event_counts_clear(struct fpga_bridge *self) {
    static const uint8_t counters[] = {BRIDGE_I2C_TIMEOUTS, BRIDGE_I2C_PROTOCOL_ERRORS,
                                       BRIDGE_BRANCH_ERRORS, BRIDGE_SPIKES};
    int error = ERROR_OK;
    for (size_t i = 0; error == ERROR_OK && i < sizeof counters; i++) {
        error = fpga_bridge_clear_count(self, counters[i]);
    }
    return error;
}

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

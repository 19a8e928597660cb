// SPDX-License-Identifier: Apache-2.0
/// The bridge's interrupt, and what it counts of errors on I2C. Errors: see fpga_bridge.h.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_EVENT_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_EVENT_H

#include "device/fpga_bridge.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Errors on I2C as the bridge counted them; saturate at 8 bits.
struct fpga_bridge_event_counts {
    uint16_t timeouts;
    uint16_t protocol_errors;  ///< START or STOP inside a byte or word
    uint16_t branch_errors;
    uint16_t spikes;  ///< removed by the filters
};

/// Which events (BRIDGE_IRQ_STATUS_*_MASK) raise the interrupt line.
int fpga_bridge_event_enable(struct fpga_bridge *self, uint16_t events);

/// The events since the last call, and clears exactly these: one of another kind that comes between
/// the two transfers is reported next time, one of the same kind counts as one with that before it.
/// `*events` is set even when clearing fails (the error says so);
/// those events are then reported again, unless they were cleared after all.
int fpga_bridge_event_take(struct fpga_bridge *self, uint16_t *events);

/// Sets events, as a test of the interrupt line.
int fpga_bridge_event_test(struct fpga_bridge *self, uint16_t events);

/// The live status: BRIDGE_STATUS_*_MASK.
int fpga_bridge_event_status(struct fpga_bridge *self, uint16_t *status);

/// Reads the counts in one transfer.
int fpga_bridge_event_counts_read(struct fpga_bridge *self, struct fpga_bridge_event_counts *out);

/// Sets the counts to 0 (four transfers).
int fpga_bridge_event_counts_clear(struct fpga_bridge *self);

#ifdef __cplusplus
}
#endif

#endif

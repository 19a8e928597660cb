// SPDX-License-Identifier: Apache-2.0
/// The bridge's interrupt. Errors: see fpga_bridge.h.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_EVENT_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_EVENT_H

#include "device/fpga_bridge.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Selects the events (BRIDGE_IRQ_STATUS_*_MASK) that raise the interrupt line.
int fpga_bridge_event_enable(struct fpga_bridge *self, uint16_t events);

/// Reads the events since the last call, and clears exactly these. An event of another kind between
/// the two transfers is reported next time; one of the same kind is merged with the earlier one.
/// `*events` is set even if clearing fails (with an error); those events are then reported again,
/// unless they were cleared after all.
int fpga_bridge_event_take(struct fpga_bridge *self, uint16_t *events);

/// Sets events, to test the interrupt line.
int fpga_bridge_event_test(struct fpga_bridge *self, uint16_t events);

/// Reads the live status: BRIDGE_STATUS_*_MASK.
int fpga_bridge_event_status(struct fpga_bridge *self, uint16_t *status);

#ifdef __cplusplus
}
#endif

#endif

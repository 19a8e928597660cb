// SPDX-License-Identifier: Apache-2.0
/// The bridge's lines to the two sensors: control lines and the I2C branches. Errors: see
/// fpga_bridge.h; ERROR_UNSUPPORTED: not in this bitstream.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_SENSOR_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_SENSOR_H

#include "device/fpga_bridge.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Levels of the sensors' lines; bit 0 is the left sensor, bit 1 the right.
struct fpga_bridge_sensor_lines {
    uint8_t reset_n;  ///< 0: held in reset
    uint8_t standby;
    uint8_t oe;      ///< 1: its outputs are enabled
    uint8_t extclk;  ///< 1: it receives a clock
};

/// Levels of the branches' lines between transfers, and whether the bridge is clearing a branch.
struct fpga_bridge_sensor_bus {
    uint8_t branch_scl, branch_sda;  ///< bit 0 left, bit 1 right
    bool clear_busy;
};

/// Sets the sensors' lines. ERROR_RANGE: a value above 3.
int fpga_bridge_sensor_drive(struct fpga_bridge *self,
                             const struct fpga_bridge_sensor_lines *lines);

/// Routes 0x5C, 0x5D and 0x5E to the sensors, or not, and sets the bypass for bring-up
/// (BRIDGE_BRANCH_CTRL_BYPASS_IS_*), which also requires `enabled`.
int fpga_bridge_sensor_route(struct fpga_bridge *self, bool enabled, uint16_t bypass);

/// Clears branches (bit 0 left, bit 1 right) on which a sensor holds SDA. Takes about 0.1 ms;
/// fpga_bridge_sensor_bus_read shows the end. Further requests are ignored meanwhile: clear both in
/// one call, or wait.
int fpga_bridge_sensor_bus_clear(struct fpga_bridge *self, uint16_t branches);
int fpga_bridge_sensor_bus_read(struct fpga_bridge *self, struct fpga_bridge_sensor_bus *out);

#ifdef __cplusplus
}
#endif

#endif

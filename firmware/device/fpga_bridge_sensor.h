// SPDX-License-Identifier: Apache-2.0
/// The bridge's lines to the two sensors, the trigger, and their branches of I2C. Errors: see
/// fpga_bridge.h; ERROR_UNSUPPORTED for what this build of the bridge lacks.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_SENSOR_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_SENSOR_H

#include "device/fpga_bridge.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Levels of the sensors' lines; bit 0 of each is for the left sensor, bit 1 for the right.
struct fpga_bridge_sensor_lines {
    uint8_t reset_n;  ///< 0: held in reset
    uint8_t standby;
    uint8_t oe;      ///< 1: its outputs are enabled
    uint8_t extclk;  ///< 1: it gets a clock
};

/// Levels of the branches' lines between transfers, and whether the bridge clears a branch now.
struct fpga_bridge_sensor_bus {
    uint8_t branch_scl, branch_sda;  ///< bit 0 left, bit 1 right
    bool clear_busy;
};

/// Drives the sensors' lines. ERROR_RANGE: a value above 3.
int fpga_bridge_sensor_drive(struct fpga_bridge *self,
                             const struct fpga_bridge_sensor_lines *lines);

/// Starts a pulse on the trigger line of the cameras (bit 0 left, bit 1 right), after a delay; not
/// while one is under way. The delay and the width are set before.
int fpga_bridge_sensor_trigger_set(struct fpga_bridge *self, uint16_t delay_us, uint16_t width_us);
int fpga_bridge_sensor_trigger(struct fpga_bridge *self, uint16_t cameras);
int fpga_bridge_sensor_trigger_busy(struct fpga_bridge *self, bool *busy);

/// Whether 0x5C, 0x5D and 0x5E are routed to the sensors, and the bypass for bring-up
/// (BRIDGE_BRANCH_CTRL_BYPASS_IS_*), which needs `enabled` too.
int fpga_bridge_sensor_route(struct fpga_bridge *self, bool enabled, uint16_t bypass);

/// Lets the bridge clear branches (bit 0 left, bit 1 right) on which a sensor holds SDA. It takes
/// about 0.1 ms; fpga_bridge_sensor_bus_read tells. The bridge ignores this meanwhile: clear both
/// in one call, or wait.
int fpga_bridge_sensor_bus_clear(struct fpga_bridge *self, uint16_t branches);
int fpga_bridge_sensor_bus_read(struct fpga_bridge *self, struct fpga_bridge_sensor_bus *out);

#ifdef __cplusplus
}
#endif

#endif

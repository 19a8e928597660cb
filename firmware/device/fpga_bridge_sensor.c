// SPDX-License-Identifier: Apache-2.0
#include "device/fpga_bridge_sensor.h"

#include "core/error.h"
#include "core/invariant.h"

int fpga_bridge_sensor_drive(struct fpga_bridge *self,
                             const struct fpga_bridge_sensor_lines *lines) {
    const unsigned both = BRIDGE_SENSOR_RESET_N_MASK >> BRIDGE_SENSOR_RESET_N_SHIFT;
    if (lines->reset_n > both || lines->standby > both || lines->oe > both ||
        lines->extclk > both) {
        return ERROR_RANGE;
    }
    const unsigned word = (unsigned)lines->reset_n << BRIDGE_SENSOR_RESET_N_SHIFT |
                          (unsigned)lines->standby << BRIDGE_SENSOR_STANDBY_SHIFT |
                          (unsigned)lines->oe << BRIDGE_SENSOR_OE_SHIFT |
                          (unsigned)lines->extclk << BRIDGE_SENSOR_EXTCLK_SHIFT;
    INVARIANT((word & ~(unsigned)fpga_bridge_register(BRIDGE_SENSOR)->stored_mask) == 0);
    return fpga_bridge_write(self, BRIDGE_SENSOR, (uint16_t)word);
}

int fpga_bridge_sensor_route(struct fpga_bridge *self, bool enabled, uint16_t bypass) {
    const int error = fpga_bridge_need(self, BRIDGE_CAPS_ROUTER_MASK);
    if (error != ERROR_OK) {
        return error;
    }
    if (bypass > BRIDGE_BRANCH_CTRL_BYPASS_MASK >> BRIDGE_BRANCH_CTRL_BYPASS_SHIFT) {
        return ERROR_RANGE;
    }
    const unsigned word = (unsigned)enabled << BRIDGE_BRANCH_CTRL_ROUTER_ENABLE_SHIFT |
                          (unsigned)bypass << BRIDGE_BRANCH_CTRL_BYPASS_SHIFT;
    return fpga_bridge_write(self, BRIDGE_BRANCH_CTRL, (uint16_t)word);
}

int fpga_bridge_sensor_bus_clear(struct fpga_bridge *self, uint16_t branches) {
    const int error = fpga_bridge_need(self, BRIDGE_CAPS_ROUTER_MASK);
    return error == ERROR_OK ? fpga_bridge_start(self, BRIDGE_BUS_CLEAR, branches) : error;
}

int fpga_bridge_sensor_bus_read(struct fpga_bridge *self, struct fpga_bridge_sensor_bus *out) {
    // The address of a transfer also goes to the branches, and holds their SCL low while the first
    // word is received. So the wanted word is the last of several.
    enum { WORDS = BRIDGE_I2C_DIAG - BRIDGE_TIME_LOW + 1 };
    _Static_assert((int)WORDS <= (int)FPGA_BRIDGE_BLOCK_WORDS, "one transfer");
    uint16_t words[WORDS];
    const int error = fpga_bridge_read_block(self, BRIDGE_TIME_LOW, WORDS, words);
    if (error == ERROR_OK) {
        const unsigned word = words[WORDS - 1];
        *out = (struct fpga_bridge_sensor_bus){
            .branch_scl =
                (word & BRIDGE_I2C_DIAG_BRANCH_SCL_MASK) >> BRIDGE_I2C_DIAG_BRANCH_SCL_SHIFT,
            .branch_sda =
                (word & BRIDGE_I2C_DIAG_BRANCH_SDA_MASK) >> BRIDGE_I2C_DIAG_BRANCH_SDA_SHIFT,
            .clear_busy = (word & BRIDGE_I2C_DIAG_CLEAR_BUSY_MASK) != 0,
        };
    }
    return error;
}

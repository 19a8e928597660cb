// SPDX-License-Identifier: Apache-2.0
/// The bridge's two servos, and the watchdog that brings them to rest when the DSP falls silent.
/// Widths of pulses are in 1/16 us ("q4"). Errors: see fpga_bridge.h; ERROR_ARGUMENT for a servo
/// that does not exist.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_SERVO_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_SERVO_H

#include "device/fpga_bridge.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FPGA_BRIDGE_SERVOS = 2 };

/// A servo's registers, of one transfer.
struct fpga_bridge_servo {
    uint16_t target_q4;  ///< asked for
    uint16_t actual_q4;  ///< width of the present or last pulse
    uint16_t min_q4, max_q4;
    uint16_t safe_q4;
    uint16_t slew_q4;  ///< greatest change from pulse to pulse
    uint16_t pulses;   ///< sent; wraps at 8 bits
};

/// Reads all of a servo.
int fpga_bridge_servo_read(struct fpga_bridge *self, unsigned servo, struct fpga_bridge_servo *out);

/// The width to go to. The hardware keeps it within the servo's limits and slew.
int fpga_bridge_servo_aim(struct fpga_bridge *self, unsigned servo, uint16_t target_q4);

/// Greatest change of the width from one pulse to the next; 0: frozen.
int fpga_bridge_servo_slew(struct fpga_bridge *self, unsigned servo, uint16_t slew_q4);

/// Where the servo goes when the watchdog fires with the action "safe".
int fpga_bridge_servo_safe(struct fpga_bridge *self, unsigned servo, uint16_t safe_q4);

/// Limits of the width. A width outside them moves in at the slew limit. Unlocks and locks (six
/// transfers).
int fpga_bridge_servo_limits(struct fpga_bridge *self, unsigned servo, uint16_t min_q4,
                             uint16_t max_q4);

/// Pulses from the next servo frame on, or none after the present one (two transfers).
int fpga_bridge_servo_enable(struct fpga_bridge *self, unsigned servo, bool enabled);

/// Start of pulse to start of pulse, in us. Unlocks and locks.
int fpga_bridge_servo_period(struct fpga_bridge *self, uint16_t period_us);

/// Longest time without a write of a register (reads do not count), once a servo has been enabled,
/// and what happens after it (BRIDGE_WDG_ACTION_IS_*). Period 0, off: unlocks and locks.
int fpga_bridge_watchdog_set(struct fpga_bridge *self, uint16_t period_ms, uint16_t action);

/// Whether it has fired.
int fpga_bridge_watchdog_fired(struct fpga_bridge *self, bool *fired);

/// Lets the servos obey again after it has fired.
int fpga_bridge_watchdog_clear(struct fpga_bridge *self);

/// Tells the bridge that the DSP is alive, by a write that starts nothing (one transfer), and looks
/// whether SCRATCH still holds the mark that the first call wrote there. ERROR_RESTARTED: it does
/// not, so the bridge was reset and has lost its settings; or somebody else wrote SCRATCH. That is
/// told once for all resets since the call before. None is missed: the mark is written only where
/// it is not.
int fpga_bridge_watchdog_feed(struct fpga_bridge *self);

#ifdef __cplusplus
}
#endif

#endif

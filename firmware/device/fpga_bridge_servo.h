// SPDX-License-Identifier: Apache-2.0
/// The bridge's two servos, and the watchdog that brings them to rest when the DSP falls silent.
/// Pulse widths are in 1/16 us ("q4"). Errors: see fpga_bridge.h; ERROR_ARGUMENT: no such servo.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_SERVO_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_SERVO_H

#include "device/fpga_bridge.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FPGA_BRIDGE_SERVOS = 2 };

/// Registers of a servo, read in one transfer.
struct fpga_bridge_servo {
    uint16_t target_q4;  ///< requested width
    uint16_t actual_q4;  ///< width of the present or last pulse
    uint16_t min_q4, max_q4;
    uint16_t safe_q4;
    uint16_t slew_q4;  ///< largest change from pulse to pulse
    uint16_t pulses;   ///< number of pulses; wraps at 8 bits
};

/// Reads all registers of a servo.
int fpga_bridge_servo_read(struct fpga_bridge *self, unsigned servo, struct fpga_bridge_servo *out);

/// Sets the target width. The hardware applies the servo's limits and slew.
int fpga_bridge_servo_aim(struct fpga_bridge *self, unsigned servo, uint16_t target_q4);

/// Sets the largest change of the width from one pulse to the next; 0: frozen.
int fpga_bridge_servo_slew(struct fpga_bridge *self, unsigned servo, uint16_t slew_q4);

/// Sets the width used when the watchdog fires with the action "safe".
int fpga_bridge_servo_safe(struct fpga_bridge *self, unsigned servo, uint16_t safe_q4);

/// Sets the limits of the width. A present width outside them moves in at the slew limit. Unlocks
/// and locks (six transfers).
int fpga_bridge_servo_limits(struct fpga_bridge *self, unsigned servo, uint16_t min_q4,
                             uint16_t max_q4);

/// Starts pulses at the next servo frame, or stops them after the present pulse (two transfers).
int fpga_bridge_servo_enable(struct fpga_bridge *self, unsigned servo, bool enabled);

/// Sets the longest time without a register write (reads do not count) once a servo has been
/// enabled, and the action after it (BRIDGE_WDG_ACTION_IS_*). Period 0 turns it off: unlocks and
/// locks.
int fpga_bridge_watchdog_set(struct fpga_bridge *self, uint16_t period_ms, uint16_t action);

/// Feeds the bridge's watchdog by a write that changes nothing (one transfer), and checks that
/// SCRATCH still holds the mark written by the first call. ERROR_RESTARTED: it does not, because
/// the bridge was reset and has lost its settings, or another program wrote SCRATCH. This is
/// reported once for all resets since the previous call. No reset is missed: the mark is written
/// only where it is missing.
int fpga_bridge_watchdog_feed(struct fpga_bridge *self);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
#include "device/fpga_bridge_servo.h"

#include "core/error.h"
#include "core/invariant.h"

enum {
    STRIDE = BRIDGE_SERVO1_TARGET_Q4 - BRIDGE_SERVO0_TARGET_Q4,
    WORDS = BRIDGE_SERVO0_FRAMES - BRIDGE_SERVO0_TARGET_Q4 + 1,
    // Neither 0, which is the value after a reset, nor all ones, nor the first register.
    MARK = 0x6A35,
};

// The register of a servo, given that of servo 0.
static uint8_t of_servo(unsigned servo, unsigned index) {
    INVARIANT(servo < FPGA_BRIDGE_SERVOS);
    INVARIANT(index >= BRIDGE_SERVO0_TARGET_Q4 && index <= BRIDGE_SERVO0_FRAMES);
    return (uint8_t)(index + servo * STRIDE);
}

int fpga_bridge_servo_read(struct fpga_bridge *self, unsigned servo,
                           struct fpga_bridge_servo *out) {
    _Static_assert((int)WORDS <= (int)FPGA_BRIDGE_BLOCK_WORDS, "one transfer");
    INVARIANT(out != NULL);
    if (servo >= FPGA_BRIDGE_SERVOS) {
        return ERROR_ARGUMENT;
    }
    uint16_t words[WORDS];
    const int error =
        fpga_bridge_read_block(self, of_servo(servo, BRIDGE_SERVO0_TARGET_Q4), WORDS, words);
    if (error != ERROR_OK) {
        return error;
    }
    *out = (struct fpga_bridge_servo){
        .target_q4 = words[0],
        .actual_q4 = words[BRIDGE_SERVO0_ACTUAL_Q4 - BRIDGE_SERVO0_TARGET_Q4],
        .min_q4 = words[BRIDGE_SERVO0_MIN_Q4 - BRIDGE_SERVO0_TARGET_Q4],
        .max_q4 = words[BRIDGE_SERVO0_MAX_Q4 - BRIDGE_SERVO0_TARGET_Q4],
        .safe_q4 = words[BRIDGE_SERVO0_SAFE_Q4 - BRIDGE_SERVO0_TARGET_Q4],
        .slew_q4 = words[BRIDGE_SERVO0_SLEW_Q4 - BRIDGE_SERVO0_TARGET_Q4],
        .pulses = words[BRIDGE_SERVO0_FRAMES - BRIDGE_SERVO0_TARGET_Q4],
    };
    return ERROR_OK;
}

static int write(struct fpga_bridge *self, unsigned servo, unsigned index, uint16_t value) {
    return servo < FPGA_BRIDGE_SERVOS ? fpga_bridge_write(self, of_servo(servo, index), value)
                                      : ERROR_ARGUMENT;
}

int fpga_bridge_servo_aim(struct fpga_bridge *self, unsigned servo, uint16_t target_q4) {
    return write(self, servo, BRIDGE_SERVO0_TARGET_Q4, target_q4);
}

int fpga_bridge_servo_slew(struct fpga_bridge *self, unsigned servo, uint16_t slew_q4) {
    return write(self, servo, BRIDGE_SERVO0_SLEW_Q4, slew_q4);
}

int fpga_bridge_servo_safe(struct fpga_bridge *self, unsigned servo, uint16_t safe_q4) {
    return write(self, servo, BRIDGE_SERVO0_SAFE_Q4, safe_q4);
}

int fpga_bridge_servo_limits(struct fpga_bridge *self, unsigned servo, uint16_t min_q4,
                             uint16_t max_q4) {
    if (servo >= FPGA_BRIDGE_SERVOS) {
        return ERROR_ARGUMENT;
    }
    const int error =
        fpga_bridge_write_unlocked(self, of_servo(servo, BRIDGE_SERVO0_MIN_Q4), min_q4);
    if (error != ERROR_OK) {
        return error;
    }
    return fpga_bridge_write_unlocked(self, of_servo(servo, BRIDGE_SERVO0_MAX_Q4), max_q4);
}

int fpga_bridge_servo_enable(struct fpga_bridge *self, unsigned servo, bool enabled) {
    if (servo >= FPGA_BRIDGE_SERVOS) {
        return ERROR_ARGUMENT;
    }
    return fpga_bridge_write_field(self,
                                   servo == 0 ? FPGA_BRIDGE_FIELD(CTRL, SERVO0_ENABLE)
                                              : FPGA_BRIDGE_FIELD(CTRL, SERVO1_ENABLE),
                                   enabled);
}

int fpga_bridge_watchdog_set(struct fpga_bridge *self, uint16_t period_ms, uint16_t action) {
    const int error = fpga_bridge_write_field(self, FPGA_BRIDGE_FIELD(WDG, ACTION), action);
    if (error != ERROR_OK) {
        return error;
    }
    return period_ms == 0 ? fpga_bridge_write_unlocked(self, BRIDGE_WDG_MS, period_ms)
                          : fpga_bridge_write(self, BRIDGE_WDG_MS, period_ms);
}

int fpga_bridge_watchdog_feed(struct fpga_bridge *self) {
    uint16_t mark = 0;
    int error = ERROR_OK;
    if (self->marked) {
        error = fpga_bridge_touch(self, BRIDGE_SCRATCH, &mark);
        if (error == ERROR_OK && mark != MARK) {  // a wrong bit in the data read is not a restart
            error = fpga_bridge_read(self, BRIDGE_SCRATCH, &mark);
        }
        if (error != ERROR_OK) {
            return error;
        }
        // Kept until it is reported: a write that failed may still have been accepted.
        self->restarted |= mark != MARK;
    }
    if (mark != MARK) {
        error = fpga_bridge_write(self, BRIDGE_SCRATCH, MARK);
    }
    if (error != ERROR_OK) {
        return error;
    }
    self->marked = true;
    const bool restarted = self->restarted;
    self->restarted = false;
    return restarted ? ERROR_RESTARTED : ERROR_OK;
}

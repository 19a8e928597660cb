// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
/// Names of the bridge's registers, for people.
#ifndef VERGENCE_BRIDGE_REGISTER_NAMES_H
#define VERGENCE_BRIDGE_REGISTER_NAMES_H

#include "bridge_registers.h"

// X(index without BRIDGE_, name)
#define BRIDGE_REGISTER_NAMES(X)                    \
    X(ID, "id")                                     \
    X(VERSION, "version")                           \
    X(BUILD, "build")                               \
    X(CAPS, "caps")                                 \
    X(SCRATCH, "scratch")                           \
    X(SERVO_PERIOD_US, "servo_period_us")           \
    X(CTRL, "ctrl")                                 \
    X(STATUS, "status")                             \
    X(IRQ_STATUS, "irq_status")                     \
    X(IRQ_ENABLE, "irq_enable")                     \
    X(IRQ_TEST, "irq_test")                         \
    X(UNLOCK, "unlock")                             \
    X(WDG_MS, "wdg_ms")                             \
    X(WDG, "wdg")                                   \
    X(SERVO0_TARGET_Q4, "servo0_target_q4")         \
    X(SERVO0_ACTUAL_Q4, "servo0_actual_q4")         \
    X(SERVO0_MIN_Q4, "servo0_min_q4")               \
    X(SERVO0_MAX_Q4, "servo0_max_q4")               \
    X(SERVO0_SAFE_Q4, "servo0_safe_q4")             \
    X(SERVO0_SLEW_Q4, "servo0_slew_q4")             \
    X(SERVO0_FRAMES, "servo0_frames")               \
    X(SERVO1_TARGET_Q4, "servo1_target_q4")         \
    X(SERVO1_ACTUAL_Q4, "servo1_actual_q4")         \
    X(SERVO1_MIN_Q4, "servo1_min_q4")               \
    X(SERVO1_MAX_Q4, "servo1_max_q4")               \
    X(SERVO1_SAFE_Q4, "servo1_safe_q4")             \
    X(SERVO1_SLEW_Q4, "servo1_slew_q4")             \
    X(SERVO1_FRAMES, "servo1_frames")               \
    X(CAM_SELECT, "cam_select")                     \
    X(CAM_STATE, "cam_state")                       \
    X(SWITCH_TIMEOUT_MS, "switch_timeout_ms")       \
    X(PPI_MODE, "ppi_mode")                         \
    X(PATTERN_WIDTH, "pattern_width")               \
    X(PATTERN_HEIGHT, "pattern_height")             \
    X(PATTERN_HBLANK, "pattern_hblank")             \
    X(PATTERN_VBLANK, "pattern_vblank")             \
    X(PATTERN_KIND, "pattern_kind")                 \
    X(PATTERN_SEED, "pattern_seed")                 \
    X(EXPECT_WIDTH, "expect_width")                 \
    X(EXPECT_HEIGHT, "expect_height")               \
    X(CAMERA0_FRAMES, "camera0_frames")             \
    X(CAMERA0_LINES, "camera0_lines")               \
    X(CAMERA0_PIXELS, "camera0_pixels")             \
    X(CAMERA0_PERIOD_10US, "camera0_period_10us")   \
    X(CAMERA0_PIXCLK_KHZ, "camera0_pixclk_khz")     \
    X(CAMERA0_SHORT_LINES, "camera0_short_lines")   \
    X(CAMERA0_SHORT_FRAMES, "camera0_short_frames") \
    X(CAMERA0_FLAGS, "camera0_flags")               \
    X(CAMERA1_FRAMES, "camera1_frames")             \
    X(CAMERA1_LINES, "camera1_lines")               \
    X(CAMERA1_PIXELS, "camera1_pixels")             \
    X(CAMERA1_PERIOD_10US, "camera1_period_10us")   \
    X(CAMERA1_PIXCLK_KHZ, "camera1_pixclk_khz")     \
    X(CAMERA1_SHORT_LINES, "camera1_short_lines")   \
    X(CAMERA1_SHORT_FRAMES, "camera1_short_frames") \
    X(CAMERA1_FLAGS, "camera1_flags")               \
    X(TRIGGER_CTRL, "trigger_ctrl")                 \
    X(TRIGGER_DELAY_US, "trigger_delay_us")         \
    X(TRIGGER_WIDTH_US, "trigger_width_us")         \
    X(SKEW_US, "skew_us")                           \
    X(FRAME_TIME_HIGH, "frame_time_high")           \
    X(FRAME_TIME_LOW, "frame_time_low")             \
    X(SENSOR, "sensor")                             \
    X(TIME_HIGH, "time_high")                       \
    X(TIME_LOW, "time_low")                         \
    X(I2C_DIAG, "i2c_diag")                         \
    X(I2C_TIMEOUTS, "i2c_timeouts")                 \
    X(I2C_PROTOCOL_ERRORS, "i2c_protocol_errors")   \
    X(BRANCH_ERRORS, "branch_errors")               \
    X(SPIKES, "spikes")                             \
    X(BUS_CLEAR, "bus_clear")                       \
    X(BRANCH_CTRL, "branch_ctrl")

#endif

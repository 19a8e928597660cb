// SPDX-License-Identifier: Apache-2.0
// From power-up to an instrument with all parts in a known state. Each step checks one part; a
// failed part stops only the steps that depend on it.
#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/lens_read.h"
#include "rig/rig.h"
#include "rig/rig_camera.h"
#include "rig/safe.h"
#include "rig/trigger.h"

enum {
    RESET_US = 1000,  // wait for a reset of the bridge, which then clears its branches for 0.1 ms
    CLOCK_US = 2000,  // time that a sensor has its clock before its reset ends
    SENSORS = 3,      // both, as bits
    LENS_STEP_US = 100000,
    // Time for the other lens on a line on which one did not answer: three times the time of an
    // answer.
    LENS_OTHER_US = 180000,
    US_PER_MS = 1000,
    // Whole periods of 50 Hz mains light: no flicker in the first pictures.
    EXPOSURE_US = 20000,
};

// Findings of the steps.
struct finding {
    struct rig_error first;
    bool bridge;
    bool sensor[RIG_SIDES];
};

static bool record(struct rig *self, struct finding *finding, int error) {
    if (error == ERROR_OK) {
        return true;
    }
    const struct hal_log *log = self->ports.log;
    if (log != NULL && error != ERROR_CANCELLED) {
        log->operations->write(log->self, HAL_LOG_ERROR, self->last_error.text);
    }
    if (finding->first.error == ERROR_OK) {
        finding->first = self->last_error;
        finding->first.error = error;
    }
    return false;
}

static int set_reset(struct rig *self, bool active) {
    const struct hal_gpio *gpio = self->ports.gpio;
    const int error = gpio == NULL
                          ? ERROR_UNSUPPORTED
                          : gpio->operations->set(gpio->self, HAL_GPIO_BRIDGE_RESET, active);
    if (error == ERROR_UNSUPPORTED) {
        return error;
    }
    rig_part_used(self, RIG_PART_RESET_LINE, error);
    return error == ERROR_OK
               ? ERROR_OK
               : rig_part_failed(self, RIG_PART_RESET_LINE, error,
                                 "it cannot be driven (check the chip's name and its permissions)");
}

// ---- the bridge

// Releases the reset, which a failed bring-up may have left active.
static int open_bridge(struct rig *self) {
    int error = set_reset(self, false);
    const bool line = error == ERROR_OK;
    if (error != ERROR_OK && error != ERROR_UNSUPPORTED) {
        return error;
    }
    error = rig_wait_until(self, rig_now_us(self) + RESET_US);
    if (error != ERROR_OK) {
        return error;
    }
    error = fpga_bridge_open(&self->bridge, self->ports.i2c, self->ports.clock);
    if (error != ERROR_OK && line) {
        error = set_reset(self, true);
        if (error == ERROR_OK) {
            error = rig_wait_until(self, rig_now_us(self) + RESET_US);
        }
        if (error == ERROR_OK) {
            error = set_reset(self, false);
        }
        if (error == ERROR_OK) {
            error = rig_wait_until(self, rig_now_us(self) + RESET_US);
        }
        if (error != ERROR_OK) {
            return error;
        }
        error = fpga_bridge_open(&self->bridge, self->ports.i2c, self->ports.clock);
    }
    return rig_bridge_used(self, error);
}

// Sets all registers to their reset values, then to those of this instrument.
static int set_bridge(struct rig *self) {
    struct fpga_bridge *bridge = &self->bridge;
    int error = fpga_bridge_need(bridge, BRIDGE_CAPS_CAMERA1_MASK | BRIDGE_CAPS_ROUTER_MASK);
    if (error == ERROR_OK) {
        error = fpga_bridge_soft_reset(bridge);
    }
    if (error == ERROR_OK) {
        error = rig_wait_until(self, rig_now_us(self) + RESET_US);
        if (error != ERROR_OK) {
            return error;
        }
        error = fpga_bridge_watchdog_set(
            bridge,
            self->profile.watchdog_ms != 0 ? self->profile.watchdog_ms : (uint16_t)US_PER_MS,
            BRIDGE_WDG_ACTION_IS_OFF);
    }
    if (error == ERROR_OK) {
        // The sensors change their outputs at the rising edge of the clock.
        error = fpga_bridge_camera_ppi_mode(
            bridge, BRIDGE_PPI_MODE_EDGE0_MASK | BRIDGE_PPI_MODE_EDGE1_MASK);
    }
    if (error == ERROR_OK) {
        error = fpga_bridge_camera_switch_limit(bridge, RIG_CAMERA_SWITCH_LIMIT_MS);
    }
    if (error == ERROR_OK) {
        error = fpga_bridge_sensor_route(bridge, true, BRIDGE_BRANCH_CTRL_BYPASS_IS_NONE);
    }
    if (error == ERROR_OK) {
        error = fpga_bridge_watchdog_feed(bridge);  // sets the mark that reveals a restart
    }
    self->fed_us = rig_now_us(self);
    self->feed_arrived_us = 0;
    return rig_bridge_used(self, error);
}

static int raise_interrupt(struct rig *self) {
    const uint16_t event = BRIDGE_IRQ_STATUS_TRIGGER_DONE_MASK;
    const int error = fpga_bridge_event_enable(&self->bridge, event);
    return error == ERROR_OK ? fpga_bridge_event_test(&self->bridge, event) : error;
}

static int clear_interrupt(struct rig *self) {
    uint16_t events = 0;
    const int error = fpga_bridge_event_enable(&self->bridge, 0);
    return error == ERROR_OK ? fpga_bridge_event_take(&self->bridge, &events) : error;
}

// Checks that the interrupt line, if connected, follows the bridge.
static int check_interrupt(struct rig *self) {
    const struct hal_gpio *gpio = self->ports.gpio;
    bool low = true, high = false;
    int seen = gpio == NULL ? ERROR_UNSUPPORTED
                            : gpio->operations->get(gpio->self, HAL_GPIO_BRIDGE_IRQ, &low);
    if (seen == ERROR_UNSUPPORTED) {
        return ERROR_OK;
    }
    int error = raise_interrupt(self);
    if (error == ERROR_OK && seen == ERROR_OK) {
        seen = gpio->operations->get(gpio->self, HAL_GPIO_BRIDGE_IRQ, &high);
    }
    error = error == ERROR_OK ? clear_interrupt(self) : error;
    if (error != ERROR_OK) {
        return rig_bridge_used(self, error);
    }
    if (seen == ERROR_OK && (low || !high)) {
        seen = ERROR_VERIFY;
    }
    rig_part_used(self, RIG_PART_IRQ_LINE, seen);
    return seen == ERROR_OK
               ? ERROR_OK
               : rig_part_failed(
                     self, RIG_PART_IRQ_LINE, seen,
                     "it does not follow the bridge (check the wire and the line's number)");
}

static int set_servo(struct rig *self, unsigned side) {
    const struct servo_model *model = &self->profile.servo[side];
    struct fpga_bridge *bridge = &self->bridge;
    int error = fpga_bridge_servo_limits(bridge, side, model->min_q4, model->max_q4);
    if (error == ERROR_OK) {
        error = fpga_bridge_servo_safe(bridge, side, model->centre_q4);
    }
    if (error == ERROR_OK) {
        error = fpga_bridge_servo_slew(bridge, side, self->profile.servo_slew_q4);
    }
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_SERVO, side);
    rig_part_used(self, part, error);
    return error == ERROR_OK ? ERROR_OK : rig_bus_failed(self, part, error);
}

// ---- the sensors

static int wake_sensors(struct rig *self) {
    struct fpga_bridge_sensor_lines lines = {.oe = SENSORS, .extclk = SENSORS};
    int error = rig_bridge_used(self, fpga_bridge_sensor_drive(&self->bridge, &lines));
    if (error == ERROR_OK) {
        error = rig_wait_until(self, rig_now_us(self) + CLOCK_US);
    }
    lines.reset_n = SENSORS;
    if (error == ERROR_OK) {
        error = rig_bridge_used(self, fpga_bridge_sensor_drive(&self->bridge, &lines));
    }
    return error == ERROR_OK ? rig_wait_until(self, rig_now_us(self) + CLOCK_US) : error;
}

// For a sensor that did not answer: checks whether something holds its branch low.
static int sensor_failed(struct rig *self, unsigned side, int error) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_SENSOR, side);
    struct fpga_bridge_sensor_bus bus;
    const int read = fpga_bridge_sensor_bus_read(&self->bridge, &bus);
    if (read != ERROR_OK) {
        return rig_bridge_used(self, read);
    }
    if ((bus.branch_sda >> side & 1) == 0 || (bus.branch_scl >> side & 1) == 0) {
        return rig_part_error(
            self, part, ERROR_I2C_STUCK,
            "its I2C lines are stuck low (cycle its power, look for a short circuit)", NULL);
    }
    return error == ERROR_I2C_NACK
               ? rig_part_error(self, part, error, "no answer on I2C (check its cable and supply)",
                                NULL)
               : rig_bus_failed(self, part, error);
}

static int open_sensor(struct rig *self, unsigned side) {
    const struct rig_profile *profile = &self->profile;
    struct mt9t001 *sensor = &self->camera[side].sensor;
    int error = mt9t001_open(sensor, self->ports.i2c, self->ports.clock,
                             profile->sensor_address[side], profile->sensor_clock_hz);
    if (error != ERROR_OK && error != ERROR_DEVICE) {
        // A sensor that was interrupted in the middle of a byte holds its branch.
        int cleared = fpga_bridge_sensor_bus_clear(&self->bridge, (uint16_t)(1u << side));
        if (cleared == ERROR_OK) {
            cleared = rig_wait_until(self, rig_now_us(self) + RESET_US);
            if (cleared != ERROR_OK) {
                return cleared;
            }
            error = mt9t001_open(sensor, self->ports.i2c, self->ports.clock,
                                 profile->sensor_address[side], profile->sensor_clock_hz);
        }
    }
    rig_part_used(self, rig_part_of(RIG_PART_LEFT_SENSOR, side), error);
    if (error != ERROR_OK) {
        return sensor_failed(self, side, error);
    }
    self->camera[side].gain_q3 = sensor->gain_q3;
    return ERROR_OK;
}

// ---- lenses

// Deadline for a lens first asked at `since_us`. A controller that sends something may still be
// answering earlier questions, those of another program, or be on a slow line.
static uint64_t lens_ends_us(const struct lens_drive *lens, uint64_t since_us,
                             uint64_t timeout_us) {
    const uint64_t last_rx_us = lens_last_rx(lens);
    const uint64_t silent_us = (last_rx_us > since_us ? last_rx_us : since_us) + timeout_us;
    const uint64_t max_us = since_us + timeout_us + LENS_READ_INVALID_US - LENS_READ_SILENCE_US;
    return silent_us < max_us ? silent_us : max_us;
}

// Waits in steps, as the time may be long.
static int open_lens(struct rig *self, unsigned side, uint64_t timeout_us) {
    const struct lens_drive *lens = &self->camera[side].lens.drive;
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_LENS, side);
    const uint64_t since_us = rig_now_us(self);
    uint64_t deadline_us = since_us + timeout_us;
    int error = ERROR_TIMEOUT;
    while (error == ERROR_TIMEOUT && rig_now_us(self) < deadline_us) {
        error = rig_poll(self);
        if (error != ERROR_OK) {
            return error;
        }
        const uint64_t step_us = rig_now_us(self) + LENS_STEP_US;
        const uint64_t until_us = step_us < deadline_us ? step_us : deadline_us;
        error = lens_open(lens, until_us);
        deadline_us = lens_ends_us(lens, since_us, timeout_us);
    }
    rig_part_used(self, part, error);
    if (error == ERROR_OK) {
        return ERROR_OK;
    }
    return rig_part_failed(
        self, part, error,
        rig_needs_lens_uart(&self->profile) && error != ERROR_TIMEOUT
            ? "the serial line of its controller cannot be used (check its name)"
            : "its controller does not answer (check its supply and its serial or I2C cable)");
}

static void bring_up_lenses(struct rig *self, struct finding *finding) {
    const struct lens_driver *driver = self->profile.lens_driver;
    const struct lens_ports ports = {
        .clock = self->ports.clock, .uart = self->ports.lens_uart, .i2c = self->ports.i2c};
    if (driver == NULL) {
        return;
    }
    lens_controller_init(&self->lens_controller, driver, &self->profile.lens, &ports);
    uint64_t timeout_us = LENS_READ_SILENCE_US;
    for (unsigned side = 0; side < driver->lenses; side++) {
        if (finding->first.error == ERROR_CANCELLED) {
            return;
        }
        self->camera[side].lens.drive = (struct lens_drive){&self->lens_controller, side};
        if (!record(self, finding, open_lens(self, side, timeout_us))) {
            self->camera[side].lens.drive.controller = NULL;
            timeout_us = LENS_OTHER_US;  // one controller serves both, and one time-out is
                                         // reported soon enough
        }
    }
}

// ---- all

// For a part that no step reached: checks whether something else responds in its place.
static void record_missing(struct rig *self, struct finding *finding, enum rig_part part) {
    const struct rig_devices *devices = self->ports.devices;
    const struct rig_part_health *health = &self->health[part];
    if (devices == NULL || health->uses != 0 || finding->first.error == ERROR_CANCELLED) {
        return;
    }
    const char *missing = devices->missing(devices->self, part);
    if (missing != NULL) {
        const int error = rig_part_used(self, part, ERROR_DEVICE);
        record(self, finding, rig_part_error(self, part, error, missing, NULL));
    }
}

static void bring_up_bridge(struct rig *self, struct finding *finding) {
    finding->bridge =
        record(self, finding, open_bridge(self)) && record(self, finding, set_bridge(self));
    if (!finding->bridge) {
        return;
    }
    record(self, finding, check_interrupt(self));
    for (unsigned side = 0; side < RIG_SIDES && self->profile.servos; side++) {
        record(self, finding, set_servo(self, side));
    }
    if (!record(self, finding, wake_sensors(self))) {
        return;
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        finding->sensor[side] = record(self, finding, open_sensor(self, side));
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if (finding->sensor[side] && finding->first.error != ERROR_CANCELLED) {
            record(self, finding, rig_lines_check(self, side));
        }
    }
}

static int start_source(struct rig *self, unsigned side, const struct hal_camera_format *format) {
    const int error = rig_camera_start_side(self, side, format);
    if (error == ERROR_OK) {
        rig_camera_take_over(self, side);
    }
    if (error != ERROR_UNSUPPORTED) {
        return error;
    }
    const int32_t size_px[] = {format->width_px, format->height_px};
    return rig_part_error(self, rig_part_of(RIG_PART_LEFT_CAMERA, side), error,
                          "it delivers no frames of # x # in a supported format (set rig.width and "
                          "rig.height to a size that both cameras support)",
                          size_px);
}

// Checks triggered cameras: each must deliver a frame with a pulse, and none without.
static void bring_up_triggered(struct rig *self, struct finding *finding) {
    struct rig_error found[RIG_SIDES];
    if (!record(self, finding, trigger_rest(self)) ||
        !record(self, finding, trigger_look(self, found))) {
        return;
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        self->last_error = found[side];
        record(self, finding, found[side].error);
    }
    if (finding->first.error == ERROR_OK) {
        record(self, finding, trigger_check_quiet(self));
    }
}

static void bring_up_sources(struct rig *self, struct finding *finding) {
    const struct hal_camera_format format = {self->profile.width_px, self->profile.height_px};
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        record(self, finding, start_source(self, side, &format));
    }
    if (self->profile.trigger) {
        bring_up_triggered(self, finding);
        return;
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        struct hal_camera_frame frame;
        if (self->camera[side].streaming && finding->first.error != ERROR_CANCELLED &&
            record(self, finding, rig_camera_take_first(self, side, &frame))) {
            raw_image_release(&frame.image);
        }
    }
}

static void forget(struct rig *self) {
    self->last_error = (struct rig_error){.error = ERROR_OK};
    self->rejected = self->last_error;
    for (int part = 0; part < RIG_PARTS; part++) {
        self->health[part] = (struct rig_part_health){.present = false};
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        self->camera[side].lens.drive = (struct lens_drive){NULL, 0};
        self->camera[side].sensor = (struct mt9t001){.bus = NULL};
        self->camera[side].pan_q4 = 0;
        self->camera[side].pan_stopped_at_us = 0;
        self->camera[side].lens.stopped_at_us = 0;
        self->camera[side].lens.moving = 0;
        self->camera[side].lens.readings[0].time_us = 0;
        self->camera[side].lens.tracked = 0;
        self->camera[side].settled_at_us = 0;
        self->camera[side].frame_pending = false;
        self->camera[side].exposure_us = 0;
        self->camera[side].initial_exposure_us = 0;
        self->camera[side].initial_gain_q3 = 0;
        self->camera[side].focus_steps = 0;
        self->camera[side].focus_part = 0;
        self->camera[side].gain_q3 = 0;
        for (unsigned axis = 0; axis < LENS_AXES; axis++) {
            self->camera[side].lens.commanded[axis] = INT32_MIN;
            self->camera[side].lens.measured[axis] = (struct lens_mean){INT32_MIN, 0};
            self->camera[side].lens.rest_us[axis] = 0;
        }
    }
    self->bridge = (struct fpga_bridge){.marked = false};
    self->pairs = 0;
}

// Devices may be waited for, until the observer stops that.
static int open_devices(struct rig *self) {
    const struct rig_devices *devices = self->ports.devices;
    if (devices == NULL) {
        return ERROR_OK;
    }
    devices->open(devices->self, &self->observer);
    return rig_poll_observer(self);
}

static void bring_up_all(struct rig *self, struct finding *finding) {
    if (self->profile.bridge) {
        bring_up_bridge(self, finding);
        record_missing(self, finding, RIG_PART_BRIDGE);
        record_missing(self, finding, RIG_PART_LEFT_CAMERA);  // one port for both
    } else {
        bring_up_sources(self, finding);
    }
    if (finding->first.error != ERROR_CANCELLED) {
        bring_up_lenses(self, finding);
    }
}

int rig_bringup(struct rig *self) {
    if (self->state == RIG_READY || self->bridge_lost) {
        rig_safe(self);
    }
    forget(self);
    self->state = RIG_DOWN;
    struct finding finding = {.first = {.error = ERROR_OK}};
    if (record(self, &finding, open_devices(self))) {
        bring_up_all(self, &finding);
    }
    if (finding.first.error == ERROR_OK) {
        self->state = RIG_READY;
        uint32_t applied_us = 0;
        int error = ERROR_OK;
        if (self->profile.bridge) {
            error = rig_window(self, self->profile.width_px, self->profile.height_px, 1);
            if (error == ERROR_OK) {
                error =
                    rig_exposure(self, 1u << RIG_LEFT | 1u << RIG_RIGHT, EXPOSURE_US, &applied_us);
            }
            if (error == ERROR_OK) {
                error = fpga_bridge_camera_stream(&self->bridge, true);
                error = rig_bridge_used(self, error);
            }
        }
        record(self, &finding, error);
    }
    if (finding.first.error == ERROR_OK) {
        return ERROR_OK;
    }
    self->state = RIG_SAFE;
    self->last_error = finding.first;
    return rig_fail_safe(self, finding.first.error);
}

// SPDX-License-Identifier: Apache-2.0
#include "rig/rig.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/base/watchdog.h"
#include "rig/rig_camera.h"
#include "rig/safe.h"
#include "rig/trigger.h"

const char *rig_ports_missing(const struct rig_profile *profile, const struct rig_ports *ports) {
    if (ports->clock == NULL) {
        return "a clock";
    }
    if (ports->camera[RIG_LEFT] == NULL || ports->camera[RIG_RIGHT] == NULL) {
        return "two cameras";
    }
    if (rig_needs_i2c(profile) && ports->i2c == NULL) {
        return "an I2C bus";
    }
    if (profile->trigger && ports->gpio == NULL) {
        return "a trigger line";
    }
    return rig_needs_lens_uart(profile) && ports->lens_uart == NULL
               ? "a line to the lens controller"
               : NULL;
}

void rig_init(struct rig *self, const struct rig_profile *profile, const struct rig_ports *ports,
              const struct rig_observer *observer) {
    struct rig_profile_error profile_error;
    INVARIANT(rig_profile_check(profile, &profile_error) == ERROR_OK);
    INVARIANT(rig_ports_missing(profile, ports) == NULL);
    *self = (struct rig){.profile = *profile, .ports = *ports, .state = RIG_DOWN};
    if (observer != NULL) {
        self->observer = *observer;
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        for (unsigned axis = 0; axis < LENS_AXES; axis++) {
            self->camera[side].lens.commanded[axis] = INT32_MIN;
            self->camera[side].lens.measured[axis] = (struct lens_mean){INT32_MIN, 0};
        }
    }
}

// ---- idle

int rig_serve(struct rig *self) {
    if (self->state != RIG_READY) {
        return ERROR_OK;
    }
    const int error = rig_watchdog_feed(self);
    return error == ERROR_OK ? ERROR_OK : rig_fail_safe(self, error);
}

int rig_idle(struct rig *self) {
    const struct hal_clock *clock = self->ports.clock;
    if (clock->operations->idle_is_due == NULL) {
        return rig_serve(self);
    }
    int error = ERROR_OK;
    while (error == ERROR_OK && clock->operations->idle_is_due(clock->self)) {
        error = rig_serve(self);
    }
    return error;
}

// ---- check

// A check reports its first error.
static void record(struct rig *self, struct rig_error *first, int error) {
    if (error != ERROR_OK && first->error == ERROR_OK) {
        *first = self->last_error;
    }
}

static int check_bridge(struct rig *self) {
    uint16_t status = 0;
    int error = fpga_bridge_watchdog_feed(&self->bridge);
    if (error == ERROR_OK) {
        error = fpga_bridge_read(&self->bridge, BRIDGE_STATUS, &status);
    }
    rig_part_used(self, RIG_PART_BRIDGE, error);
    if (error != ERROR_OK) {
        return rig_bus_failed(self, RIG_PART_BRIDGE, error);
    }
    self->fed_us = rig_now_us(self);
    rig_watchdog_fed(self);
    if ((status & BRIDGE_STATUS_WATCHDOG_FIRED_MASK) != 0) {
        rig_part_used(self, RIG_PART_BRIDGE, ERROR_TIMEOUT);
        return rig_part_error(self, RIG_PART_BRIDGE, ERROR_TIMEOUT,
                              "its watchdog fired because this program was late (run bringup)",
                              NULL);
    }
    return ERROR_OK;
}

static int check_camera(struct rig *self, unsigned side) {
    const enum rig_part sensor = rig_part_of(RIG_PART_LEFT_SENSOR, side);
    const enum rig_part camera = rig_part_of(RIG_PART_LEFT_CAMERA, side);
    int error = rig_part_used(self, sensor, mt9t001_check(&self->camera[side].sensor));
    if (error != ERROR_OK) {
        return rig_bus_failed(self, sensor, error);
    }
    struct fpga_bridge_camera seen;
    error =
        rig_part_used(self, RIG_PART_BRIDGE, fpga_bridge_camera_read(&self->bridge, side, &seen));
    if (error != ERROR_OK) {
        return rig_bus_failed(self, RIG_PART_BRIDGE, error);
    }
    if (rig_part_used(self, camera, seen.lost ? ERROR_TIMEOUT : ERROR_OK) != ERROR_OK) {
        return rig_part_error(self, camera, ERROR_TIMEOUT,
                              "no pixel clock (check its cable, supply and clock)", NULL);
    }
    return ERROR_OK;
}

static int check_servo(struct rig *self, unsigned side) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_SERVO, side);
    struct fpga_bridge_servo servo;
    const int error = fpga_bridge_servo_read(&self->bridge, side, &servo);
    rig_part_used(self, part, error);
    return error == ERROR_OK ? ERROR_OK : rig_bus_failed(self, part, error);
}

// Takes a frame of a camera with its own port.
static int check_source(struct rig *self, unsigned side) {
    struct hal_camera_frame frame;
    const int error = rig_camera_take(self, side, rig_now_us(self), &frame);
    if (error == ERROR_OK) {
        raw_image_release(&frame.image);
    }
    return error;
}

// Takes a frame of each of two triggered cameras.
static void check_triggered(struct rig *self, struct rig_error *first) {
    struct rig_error found[RIG_SIDES];
    const int error = trigger_look(self, found);
    record(self, first, error);
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        self->last_error = found[side];
        record(self, first, found[side].error);
    }
}

static int check_lens(struct rig *self, unsigned side) {
    int32_t positions[LENS_AXES];
    return rig_has_lens(&self->profile, side) ? rig_lens_read(self, side, positions) : ERROR_OK;
}

// `of_bridge`: whether the bridge works.
static void check_side(struct rig *self, unsigned side, int of_bridge, struct rig_error *first) {
    const bool bridge = self->profile.bridge;
    if (!bridge && !self->profile.trigger) {
        record(self, first, check_source(self, side));
    } else if (bridge && of_bridge == ERROR_OK) {
        record(self, first, check_camera(self, side));
    }
    if (self->profile.servos && of_bridge == ERROR_OK) {
        record(self, first, check_servo(self, side));
    }
    record(self, first, check_lens(self, side));
}

int rig_check(struct rig *self) {
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    struct rig_error first = {.error = ERROR_OK};
    const bool bridge = self->profile.bridge;
    const int of_bridge = bridge ? check_bridge(self) : ERROR_OK;
    record(self, &first, of_bridge);
    if (self->profile.trigger) {
        check_triggered(self, &first);
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        check_side(self, side, of_bridge, &first);
    }
    if (first.error == ERROR_OK) {
        return ERROR_OK;
    }
    self->last_error = first;
    // Without the bridge the servos are not held, and settings are lost; the bridge may have been
    // lost meanwhile.
    const bool gone = of_bridge != ERROR_OK || self->state != RIG_READY;
    return gone ? rig_fail_safe(self, first.error) : first.error;
}

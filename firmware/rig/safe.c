// SPDX-License-Identifier: Apache-2.0
#include "rig/safe.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/rig_camera.h"
#include "rig/trigger.h"

enum {
    LENS_STOP_US = 100000,
    CTRL_REST = 0,  // no pulses, no frames
};

// Stops motors that can be stopped; others end where they were sent, which is within their range.
static int stop_lenses(struct rig *self) {
    int first = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const struct lens_drive *lens = &self->camera[side].lens.drive;
        if (lens->controller == NULL || !lens->controller->driver->abilities.stops) {
            continue;
        }
        const enum rig_part part = rig_part_of(RIG_PART_LEFT_LENS, side);
        const uint64_t deadline_us = rig_now_us(self) + LENS_STOP_US;
        const int error = rig_part_used(self, part, lens_stop(lens, deadline_us));
        if (error != ERROR_OK && first == ERROR_OK) {
            first = rig_part_failed(self, part, error,
                                    "it cannot be stopped (switch its controller off)");
        }
    }
    return first;
}

// Holds the bridge in reset: no pulses, no frames. ERROR_UNSUPPORTED: there is no reset line.
static int hold_bridge(struct rig *self) {
    const struct hal_gpio *gpio = self->ports.gpio;
    const int error = gpio == NULL ? ERROR_UNSUPPORTED
                                   : gpio->operations->set(gpio->self, HAL_GPIO_BRIDGE_RESET, true);
    return error == ERROR_UNSUPPORTED ? error : rig_part_used(self, RIG_PART_RESET_LINE, error);
}

// One transfer stops pulses and frames. If it fails, the bridge is held in reset; without a reset
// line, its watchdog expires, as it gets no more feeds.
static int rest_bridge(struct rig *self) {
    if (!self->profile.bridge) {
        return ERROR_OK;
    }
    if (self->bridge.bus.bus == NULL) {
        // Never opened, so nothing started by this program runs there; an earlier program may have
        // left something running.
        const int held = hold_bridge(self);
        if (held == ERROR_OK || held == ERROR_UNSUPPORTED) {
            return ERROR_OK;
        }
        return rig_part_failed(self, RIG_PART_RESET_LINE, held,
                               "it cannot be driven (check the chip's name and its permissions)");
    }
    const int error = rig_part_used(self, RIG_PART_BRIDGE,
                                    fpga_bridge_write(&self->bridge, BRIDGE_CTRL, CTRL_REST));
    if (error == ERROR_OK) {
        return ERROR_OK;
    }
    hold_bridge(self);
    return rig_bus_failed(self, RIG_PART_BRIDGE, error);
}

static int rest_trigger(struct rig *self) {
    return self->profile.trigger ? trigger_rest(self) : ERROR_OK;
}

int rig_safe(struct rig *self) {
    static int (*const steps[])(struct rig *) = {rest_bridge, rest_trigger, stop_lenses,
                                                 rig_camera_stop};
    int first = ERROR_OK;
    struct rig_error last_error = self->last_error;
    self->bridge_lost = false;
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        const int error = steps[i](self);
        if (first == ERROR_OK && error != ERROR_OK) {
            first = error;
            last_error = self->last_error;
        }
    }
    self->last_error = last_error;
    self->state = self->state == RIG_DOWN ? RIG_DOWN : RIG_SAFE;
    return first;
}

int rig_end(struct rig *self, int error) {
    return self->bridge_lost && error != ERROR_OK ? rig_fail_safe(self, error) : error;
}

int rig_fail_safe(struct rig *self, int error) {
    INVARIANT(error != ERROR_OK);
    const struct rig_error first = self->last_error;
    rig_safe(self);
    self->last_error = first;
    return error;
}

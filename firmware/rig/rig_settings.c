// SPDX-License-Identifier: Apache-2.0
// Settings of the frames: exposure, gain, window.
#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/rig.h"
#include "rig/rig_camera.h"
#include "rig/safe.h"

enum {
    BOTH_SIDES = 1 << RIG_LEFT | 1 << RIG_RIGHT,
    // A webcam's lens is at rest again after this time, and this long for its whole way.
    FOCUS_REST_US = 80000,
    FOCUS_WAY_US = 200000,
    // Longer than any frame takes to be sent. What a setting takes effect after, up to three frames
    // of long exposures, is then abandoned.
    RESTART_US = 100000,
};

static int refuse_sides(unsigned sides) {
    return sides == 0 || (sides & ~(unsigned)BOTH_SIDES) != 0 ? ERROR_ARGUMENT : ERROR_OK;
}

int rig_camera_sensor_was_set(struct rig *self, unsigned side, uint64_t before_us, int error) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_SENSOR, side);
    const uint64_t frame_us = rig_camera_frame_us(self, side);
    const bool restart = error == ERROR_OK && (before_us > RESTART_US || frame_us > RESTART_US);
    error = restart ? mt9t001_restart(&self->camera[side].sensor) : error;
    rig_part_used(self, part, error);
    if (restart) {
        self->camera[side].settled_at_us = rig_now_us(self);
    } else {
        rig_camera_unsettle(self, side, before_us);
    }
    return error == ERROR_OK ? ERROR_OK : rig_fail_safe(self, rig_bus_failed(self, part, error));
}

// `numbers`: the requested value, and the nearest possible one.
static int refuse_control(struct rig *self, enum rig_part part, int error,
                          enum hal_camera_control which, const int32_t numbers[2]) {
    const char *what = "no such control (set it with the camera's own program)";
    if (error == ERROR_RANGE) {
        what = which == HAL_CAMERA_EXPOSURE_US && numbers[1] != INT32_MIN
                   ? "exposure # us is not supported (the nearest is # us)"
                   : "this value is not supported (choose one closer to its range)";
    }
    return rig_reject(self, part, error, what, numbers);
}

// Whether a value that a camera reports is possible. Data from a driver is untrusted.
static bool can_be(enum hal_camera_control which, int32_t value) {
    return value >= 0 && (which == HAL_CAMERA_EXPOSURE_US || value <= RIG_CAMERA_PARTS);
}

// Sets a control of a camera with its own port.
static int control(struct rig *self, unsigned side, enum hal_camera_control which, int32_t value,
                   int32_t *applied) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_CAMERA, side);
    const struct hal_camera *camera = self->ports.camera[side];
    int32_t nearest = INT32_MIN;  // value while the camera has not reported one
    const int error = camera->operations->control == NULL
                          ? ERROR_UNSUPPORTED
                          : camera->operations->control(camera->self, which, value, &nearest);
    if (error == ERROR_UNSUPPORTED || error == ERROR_RANGE) {
        *applied = error == ERROR_RANGE && can_be(which, nearest) ? nearest : *applied;
        return refuse_control(self, part, error, which, (const int32_t[]){value, nearest});
    }
    rig_part_used(self, part, error);
    if (error != ERROR_OK) {
        return rig_fail_safe(
            self,
            rig_part_failed(self, part, error,
                            "it does not accept a setting (check its plug, then run bringup)"));
    }
    if (!can_be(which, nearest)) {
        return rig_fail_safe(self,
                             rig_part_error(self, part, ERROR_VERIFY,
                                            "it reports the impossible setting # (run bringup, "
                                            "or set it with the camera's own program)",
                                            &nearest));
    }
    *applied = nearest;
    const uint64_t wait_us = MT9T001_FRAMES_TO_SETTLE * rig_camera_frame_us(self, side);
    self->camera[side].settled_at_us = rig_now_us(self) + wait_us;
    return ERROR_OK;
}

int rig_camera_set_exposure(struct rig *self, unsigned side, uint32_t exposure_us,
                            uint32_t *applied_us) {
    if (!self->profile.bridge) {
        int32_t applied = (int32_t)*applied_us;
        const int error =
            control(self, side, HAL_CAMERA_EXPOSURE_US, (int32_t)exposure_us, &applied);
        *applied_us = (uint32_t)applied;
        if (error == ERROR_OK) {
            self->camera[side].exposure_us = (uint32_t)applied;
            self->camera[side].initial_exposure_us = 0;
        }
        return error;
    }
    struct mt9t001 *sensor = &self->camera[side].sensor;
    struct mt9t001_timing timing;
    int error = mt9t001_timing_of(&sensor->window, 1, sensor->clock_hz, &timing);
    INVARIANT(error == ERROR_OK);
    const uint64_t before_us = rig_camera_frame_us(self, side);
    error = mt9t001_set_shutter(sensor, mt9t001_rows_for(&timing, exposure_us));
    rig_camera_note_exposure(self, side);
    error = rig_camera_sensor_was_set(self, side, before_us, error);
    *applied_us = error == ERROR_OK ? self->camera[side].exposure_us : *applied_us;
    return error;
}

int rig_exposure(struct rig *self, unsigned sides, uint32_t exposure_us, uint32_t *applied_us) {
    int error = refuse_sides(sides);
    if (error != ERROR_OK) {
        return error;
    }
    if (exposure_us < 1 || exposure_us > RIG_EXPOSURE_MAX_US) {
        return ERROR_RANGE;
    }
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        if ((sides >> side & 1) != 0) {
            error = rig_camera_set_exposure(self, side, exposure_us, applied_us);
        }
    }
    return error;
}

int rig_camera_set_gain(struct rig *self, unsigned side, uint16_t gain_q3) {
    if (!self->profile.bridge) {
        // Such cameras have a scale of their own.
        const int32_t span = MT9T001_GAIN_Q3_MAX - MT9T001_GAIN_Q3_MIN;
        const int32_t part = ((gain_q3 - MT9T001_GAIN_Q3_MIN) * RIG_CAMERA_PARTS + span / 2) / span;
        int32_t applied = 0;
        const int error = control(self, side, HAL_CAMERA_GAIN_PART, part, &applied);
        if (error == ERROR_OK) {
            self->camera[side].gain_q3 = rig_camera_gain_of(applied);
        }
        return error;
    }
    const int error = mt9t001_set_gain(&self->camera[side].sensor, gain_q3);
    self->camera[side].gain_q3 = self->camera[side].sensor.gain_q3;
    return rig_camera_sensor_was_set(self, side, rig_camera_frame_us(self, side), error);
}

int rig_gain(struct rig *self, unsigned sides, uint16_t gain_q3, uint16_t *applied_q3) {
    int error = refuse_sides(sides);
    if (error != ERROR_OK) {
        return error;
    }
    if (gain_q3 < MT9T001_GAIN_Q3_MIN || gain_q3 > MT9T001_GAIN_Q3_MAX) {
        return ERROR_RANGE;
    }
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        if ((sides >> side & 1) != 0) {
            error = rig_camera_set_gain(self, side, gain_q3);
            *applied_q3 = error == ERROR_OK ? self->camera[side].gain_q3 : *applied_q3;
        }
    }
    return error;
}

int rig_focus_part(struct rig *self, unsigned side, int32_t part, int32_t *applied) {
    INVARIANT(side < RIG_SIDES);
    if (part < 0 || part > RIG_CAMERA_PARTS) {
        return ERROR_RANGE;
    }
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    if (self->camera[side].focus_steps == 0) {
        return rig_reject(self, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_UNSUPPORTED,
                          "it has no focus control (turn its lens by hand)", NULL);
    }
    struct rig_camera *camera = &self->camera[side];
    const uint64_t settled_at_us = camera->settled_at_us;
    const int error = control(self, side, HAL_CAMERA_FOCUS_PART, part, applied);
    if (error != ERROR_OK) {
        return error;
    }
    // The lens acts at once, unlike a setting of the sensor.
    const int32_t way = *applied - camera->focus_part;
    const uint64_t rest_us = rig_now_us(self) + FOCUS_REST_US +
                             (uint64_t)(way < 0 ? -way : way) * FOCUS_WAY_US / RIG_CAMERA_PARTS;
    camera->settled_at_us = settled_at_us > rest_us ? settled_at_us : rest_us;
    camera->focus_part = *applied;
    return ERROR_OK;
}

static int set_sensor_window(struct rig *self, unsigned side, const struct mt9t001_window *window) {
    struct mt9t001 *sensor = &self->camera[side].sensor;
    const uint64_t before_us = rig_camera_frame_us(self, side);
    const int error = mt9t001_set_window(sensor, window);
    rig_camera_note_exposure(self, side);
    return rig_camera_sensor_was_set(self, side, before_us, error);
}

// Switches sensors and the bridge to another window.
static int set_sensor_windows(struct rig *self, unsigned sides,
                              const struct mt9t001_window *window) {
    int error = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        if ((sides >> side & 1) != 0) {
            error = set_sensor_window(self, side, window);
        }
    }
    if (error != ERROR_OK) {
        return error;
    }
    error = rig_bridge_used(
        self, fpga_bridge_camera_expect(&self->bridge, window->width_px / window->skip,
                                        window->height_px / window->skip));
    return error == ERROR_OK ? ERROR_OK : rig_fail_safe(self, error);
}

// The cameras do not support this size: return to the previous one. This is a rejected argument,
// not a failure of a camera.
static int take_back(struct rig *self, const struct hal_camera_format *before,
                     const struct rig_error *last_error, const uint32_t failures[RIG_SIDES]) {
    const struct rig_error why = self->last_error;
    const int stopped = rig_camera_stop(self);
    const int back = stopped == ERROR_OK ? rig_camera_start(self, before) : stopped;
    if (back != ERROR_OK || self->profile.bridge) {
        self->last_error = why;
        return rig_fail_safe(self, why.error);
    }
    self->rejected = why;
    self->last_error = *last_error;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        self->health[rig_part_of(RIG_PART_LEFT_CAMERA, side)].failures = failures[side];
    }
    return why.error;
}

// Switches the sources of the frames to another size.
static int set_format(struct rig *self, const struct hal_camera_format *format) {
    const struct hal_camera_format before = self->format;
    const struct rig_error last_error = self->last_error;
    const uint32_t failures[RIG_SIDES] = {self->health[RIG_PART_LEFT_CAMERA].failures,
                                          self->health[RIG_PART_RIGHT_CAMERA].failures};
    int error = rig_camera_stop(self);
    if (error == ERROR_OK) {
        error = rig_camera_start(self, format);
    }
    if (error == ERROR_UNSUPPORTED && before.width_px != 0) {
        return take_back(self, &before, &last_error, failures);
    }
    return error == ERROR_OK ? ERROR_OK : rig_fail_safe(self, error);
}

static int set_windows(struct rig *self, unsigned sides, const struct mt9t001_window *window) {
    const struct hal_camera_format format = {(uint16_t)(window->width_px / window->skip),
                                             (uint16_t)(window->height_px / window->skip)};
    const int error = set_sensor_windows(self, sides, window);
    return error == ERROR_OK ? set_format(self, &format) : error;
}

int rig_window(struct rig *self, uint16_t width_px, uint16_t height_px, uint8_t skip) {
    struct mt9t001_window window = {.skip = 1};
    int error = ERROR_OK;
    if (self->profile.bridge) {
        error = mt9t001_centred_window(width_px, height_px, skip, 1, &window);
    } else if (skip != 1) {
        error = ERROR_UNSUPPORTED;
    }
    if (error != ERROR_OK) {
        return error;
    }
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    const struct hal_camera_format format = {width_px, height_px};
    return self->profile.bridge ? set_windows(self, BOTH_SIDES, &window)
                                : set_format(self, &format);
}

int rig_window_at(struct rig *self, unsigned sides, const struct rig_rectangle *where_px,
                  uint8_t skip) {
    struct mt9t001_window window = mt9t001_full_window();
    struct mt9t001_timing timing;
    window.column_px = where_px->column_px;
    window.row_px = where_px->row_px;
    window.width_px = where_px->width_px;
    window.height_px = where_px->height_px;
    window.skip = skip;
    const int error = refuse_sides(sides);
    if (error != ERROR_OK) {
        return error;
    }
    if (!self->profile.bridge) {
        return ERROR_UNSUPPORTED;
    }
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    if (mt9t001_timing_of(&window, 1, self->profile.sensor_clock_hz, &timing) != ERROR_OK) {
        return ERROR_RANGE;
    }
    const struct mt9t001_window *other =
        &self->camera[(sides >> RIG_LEFT & 1) != 0 ? RIG_RIGHT : RIG_LEFT].sensor.window;
    if (sides != BOTH_SIDES &&
        (other->width_px != window.width_px || other->height_px != window.height_px ||
         other->skip != window.skip)) {
        return ERROR_RANGE;
    }
    return set_windows(self, sides, &window);
}

// SPDX-License-Identifier: Apache-2.0
#include "rig/rig_camera.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"

enum {
    // Time to wait for a frame: this many frame periods, for the one under way at the start, the
    // one wanted and one lost, plus this constant.
    TIMEOUT_FRAMES = 3,
    TIMEOUT_US = 250000,
    // Webcams need up to this long from start to the first frame.
    FIRST_FRAME_US = 1700000,
    // Plus this many exposures: of the frame under way at the start, which may be lost, and of the
    // frame itself.
    FIRST_EXPOSURES = 2,
    SWITCH_LOOK_US = 5000,
    SWITCH_TIMEOUT_US = 600000,  // twice the longest limit of the bridge, plus frames
    COUNT_FULL = 255,            // value at which the bridge's error counters saturate
};

static uint64_t later(uint64_t a, uint64_t b) {
    return a > b ? a : b;
}

static uint64_t sooner(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

// Behind the bridge both sides share one port.
static bool has_source(const struct rig *self, unsigned side) {
    return !self->profile.bridge || side == RIG_LEFT;
}

uint32_t rig_camera_exposure_us(const struct rig *self, unsigned side) {
    return self->camera[side].exposure_us != 0 ? self->camera[side].exposure_us
                                               : self->camera[side].initial_exposure_us;
}

uint16_t rig_camera_gain_q3(const struct rig *self, unsigned side) {
    return self->camera[side].gain_q3 != 0 ? self->camera[side].gain_q3
                                           : self->camera[side].initial_gain_q3;
}

uint64_t rig_camera_frame_us(const struct rig *self, unsigned side) {
    const struct mt9t001 *sensor = &self->camera[side].sensor;
    if (sensor->bus == NULL) {
        return later(self->profile.frame_us, rig_camera_exposure_us(self, side));
    }
    struct mt9t001_timing timing;
    const int error =
        mt9t001_timing_of(&sensor->window, sensor->shutter_rows, sensor->clock_hz, &timing);
    INVARIANT(error == ERROR_OK);
    return timing.frame_us;
}

void rig_camera_unsettle(struct rig *self, unsigned side, uint64_t before_us) {
    const uint64_t wait_us = before_us + MT9T001_FRAMES_TO_SETTLE * rig_camera_frame_us(self, side);
    self->camera[side].settled_at_us =
        later(self->camera[side].settled_at_us, rig_now_us(self) + wait_us);
}

static const char *describe_source_error(int error) {
    if (error == ERROR_UNSUPPORTED) {
        return "it has no frames of this size (choose another window)";
    }
    if (error == ERROR_DEVICE) {
        return "it is gone (check its plug, then run bringup)";
    }
    return "the system cannot start its frames (see the system log)";
}

static int source_failed(struct rig *self, unsigned side, int error) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_CAMERA, side);
    return rig_part_failed(self, part, error, describe_source_error(error));
}

// A working port behind the bridge does not prove that the camera works.
static int of_source(struct rig *self, unsigned side, int error) {
    if (error != ERROR_OK || !self->profile.bridge) {
        rig_part_used(self, rig_part_of(RIG_PART_LEFT_CAMERA, side), error);
    }
    return error;
}

int rig_camera_start_side(struct rig *self, unsigned side, const struct hal_camera_format *format) {
    const struct hal_camera *camera = self->ports.camera[side];
    INVARIANT(camera != NULL && has_source(self, side));
    const int error = of_source(self, side, camera->operations->start(camera->self, format));
    if (error != ERROR_OK) {
        return source_failed(self, side, error);
    }
    self->camera[side].streaming = true;
    self->camera[side].started_us = rig_now_us(self);
    self->camera[side].frame_pending = false;
    self->format = *format;
    return ERROR_OK;
}

void rig_camera_note_exposure(struct rig *self, unsigned side) {
    const struct mt9t001 *sensor = &self->camera[side].sensor;
    struct mt9t001_timing timing;
    const int error =
        mt9t001_timing_of(&sensor->window, sensor->shutter_rows, sensor->clock_hz, &timing);
    INVARIANT(error == ERROR_OK);
    self->camera[side].exposure_us = (uint32_t)mt9t001_exposure_us(&timing, sensor->shutter_rows);
}

// Calls a control of a camera that takes no value. `missing`: the camera does not report it; others
// are limited to 0 .. max, as data from a driver is untrusted.
static int32_t found(struct rig *self, unsigned side, enum hal_camera_control which, int32_t max,
                     int32_t missing) {
    const struct hal_camera *camera = self->ports.camera[side];
    int32_t value = 0;
    const int error = camera->operations->control(camera->self, which, 0, &value);
    if (error != ERROR_OK || value < 0) {
        return missing;
    }
    return value < max ? value : max;
}

uint16_t rig_camera_gain_of(int32_t part) {
    const int32_t span = MT9T001_GAIN_Q3_MAX - MT9T001_GAIN_Q3_MIN;
    INVARIANT(part >= 0 && part <= RIG_CAMERA_PARTS);
    return (uint16_t)(MT9T001_GAIN_Q3_MIN +
                      (part * span + RIG_CAMERA_PARTS / 2) / RIG_CAMERA_PARTS);
}

// What a camera sets automatically is off from now on: it must not change between two frames.
static void switch_automatic_off(struct rig *self, unsigned side) {
    static const struct {
        unsigned bit;
        const char *off, *still_on;
    } controls[] = {
        {HAL_CAMERA_AUTO_EXPOSURE, "its automatic exposure is now off",
         "its automatic exposure cannot be switched off (use the camera's own program)"},
        {HAL_CAMERA_AUTO_GAIN, "its automatic gain is now off",
         "its automatic gain cannot be switched off (use the camera's own program)"},
        {HAL_CAMERA_AUTO_FOCUS, "its automatic focus is now off",
         "its automatic focus cannot be switched off (use the camera's own program)"},
        {HAL_CAMERA_AUTO_WHITE_BALANCE, "its automatic white balance is now off",
         "its automatic white balance cannot be switched off (use the camera's own program)"},
    };
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_CAMERA, side);
    const int32_t automatic = found(self, side, HAL_CAMERA_AUTOMATIC_OFF, UINT8_MAX, 0);
    for (size_t i = 0; i < sizeof controls / sizeof controls[0]; i++) {
        if (((unsigned)automatic >> HAL_CAMERA_AUTO_STILL & controls[i].bit) != 0) {
            rig_part_log(self, part, HAL_LOG_WARNING, controls[i].still_on);
        } else if (((unsigned)automatic & controls[i].bit) != 0) {
            rig_part_log(self, part, HAL_LOG_NOTICE, controls[i].off);
        }
    }
}

void rig_camera_take_over(struct rig *self, unsigned side) {
    const struct hal_camera *port = self->ports.camera[side];
    struct rig_camera *camera = &self->camera[side];
    INVARIANT(port != NULL && !self->profile.bridge);
    if (port->operations->control == NULL) {
        return;
    }
    switch_automatic_off(self, side);
    camera->initial_exposure_us =
        (uint32_t)found(self, side, HAL_CAMERA_EXPOSURE_FOUND_US, RIG_EXPOSURE_MAX_US, 0);
    const int32_t part = found(self, side, HAL_CAMERA_GAIN_FOUND_PART, RIG_CAMERA_PARTS, -1);
    camera->initial_gain_q3 = part < 0 ? 0 : rig_camera_gain_of(part);
    camera->focus_steps = (uint16_t)found(self, side, HAL_CAMERA_FOCUS_STEPS, UINT16_MAX, 0);
    camera->focus_part = found(self, side, HAL_CAMERA_FOCUS_FOUND_PART, RIG_CAMERA_PARTS, 0);
}

int rig_camera_start(struct rig *self, const struct hal_camera_format *format) {
    const struct hal_camera_format before = self->format;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const int error =
            has_source(self, side) ? rig_camera_start_side(self, side, format) : ERROR_OK;
        if (error != ERROR_OK) {
            self->format = before;
            return error;
        }
    }
    return ERROR_OK;
}

int rig_camera_stop(struct rig *self) {
    int first = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const struct hal_camera *camera = self->ports.camera[side];
        if (!self->camera[side].streaming) {
            continue;
        }
        self->camera[side].streaming = false;
        const int error = of_source(self, side, camera->operations->stop(camera->self));
        if (error != ERROR_OK && first == ERROR_OK) {
            first = source_failed(self, side, error);
        }
    }
    return first;
}

// Finds out why no frame came.
static int no_frame(struct rig *self, unsigned side, int error) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_CAMERA, side);
    if (error != ERROR_TIMEOUT) {
        return source_failed(self, side, error);
    }
    struct fpga_bridge_camera seen;
    const char *what = "no frame in time (check its cable, then run bringup)";
    if (self->profile.bridge) {
        const int read = rig_bridge_used(self, fpga_bridge_camera_read(&self->bridge, side, &seen));
        if (read != ERROR_OK) {
            return read;
        }
        what = seen.lost ? "no pixel clock (check its cable, supply and clock)"
                         : "its clock runs, but no frame reaches the port (check FRAME_VALID and "
                           "the port's cable)";
    }
    return rig_part_error(self, part, error, what, NULL);
}

int rig_camera_choose(struct rig *self, unsigned side) {
    static const uint16_t sources[RIG_SIDES] = {BRIDGE_CAM_SELECT_SOURCE_IS_LEFT,
                                                BRIDGE_CAM_SELECT_SOURCE_IS_RIGHT};
    struct fpga_bridge_source source;
    const uint64_t frame_us =
        later(rig_camera_frame_us(self, RIG_LEFT), rig_camera_frame_us(self, RIG_RIGHT));
    const uint64_t deadline_us = rig_now_us(self) + 2 * frame_us + SWITCH_TIMEOUT_US;
    bool asked = false;
    for (;;) {
        int error = rig_bridge_used(self, fpga_bridge_camera_source(&self->bridge, &source));
        if (error == ERROR_OK && source.active == sources[side] && source.gate_open &&
            !source.switching) {
            return ERROR_OK;
        }
        if (error == ERROR_OK && !asked) {
            error = rig_bridge_used(self, fpga_bridge_camera_select(&self->bridge, sources[side]));
            asked = true;
        }
        if (error != ERROR_OK) {
            return error;
        }
        if (rig_now_us(self) >= deadline_us) {
            rig_part_used(self, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_TIMEOUT);
            return no_frame(self, side, ERROR_TIMEOUT);
        }
        error = rig_wait_until(self, rig_now_us(self) + SWITCH_LOOK_US);
        if (error != ERROR_OK) {
            return error;
        }
    }
}

// Whether the bridge counted errors between two readings. A saturated counter stays and cannot be
// cleared; then the bridge's flags of the camera's last frame count, which is the frame waited for.
static bool has_counted(uint16_t before, uint16_t after, bool last) {
    return after != before || (after >= COUNT_FULL && last);
}

uint32_t rig_camera_counted(const struct fpga_bridge_camera *before,
                            const struct fpga_bridge_camera *after) {
    const bool lines = has_counted(before->short_lines, after->short_lines, after->short_line);
    const bool frames = has_counted(before->short_frames, after->short_frames, after->short_frame);
    return (lines ? HAL_CAMERA_SHORT_LINE : 0u) | (frames ? HAL_CAMERA_SHORT : 0u);
}

// Waits for a frame in steps, so that the observer is called and the watchdog fed; at least once.
static int wait_until(struct rig *self, unsigned side, uint64_t begin_us, uint64_t deadline_us,
                      struct hal_camera_frame *frame) {
    const struct hal_camera *camera = self->ports.camera[side];
    int error = ERROR_TIMEOUT;
    uint64_t now_us = 0;
    do {
        error = rig_poll(self);
        if (error != ERROR_OK) {
            return error;
        }
        now_us = rig_now_us(self);
        error = camera->operations->take(camera->self, begin_us,
                                         sooner(now_us + RIG_POLL_US, deadline_us), frame);
        now_us = rig_now_us(self);
    } while (error == ERROR_TIMEOUT && now_us < deadline_us);
    rig_part_used(self, rig_part_of(RIG_PART_LEFT_CAMERA, side), error);
    return error == ERROR_OK ? ERROR_OK : no_frame(self, side, error);
}

// The earliest begin of a frame that was exposed with the camera at rest: rows are exposed before
// they are sent.
static uint64_t still_us(const struct rig *self, unsigned side) {
    return later(self->camera[side].pan_stopped_at_us, self->camera[side].lens.stopped_at_us) +
           rig_camera_exposure_us(self, side);
}

int rig_camera_wait(struct rig *self, unsigned side, uint64_t not_before_us,
                    struct hal_camera_frame *frame) {
    const uint64_t begin_us =
        later(later(not_before_us, self->camera[side].settled_at_us), still_us(self, side));
    const uint64_t now_us = rig_now_us(self);
    uint64_t deadline_us =
        later(begin_us, now_us) + TIMEOUT_FRAMES * rig_camera_frame_us(self, side) + TIMEOUT_US;
    if (!self->profile.bridge) {
        deadline_us = later(deadline_us, self->camera[side].started_us + FIRST_FRAME_US);
    }
    return wait_until(self, side, begin_us, deadline_us, frame);
}

int rig_camera_take_first(struct rig *self, unsigned side, struct hal_camera_frame *frame) {
    INVARIANT(side < RIG_SIDES && self->camera[side].streaming && !self->profile.bridge);
    const uint64_t started_us = self->camera[side].started_us;
    const uint64_t deadline_us = started_us + FIRST_FRAME_US +
                                 FIRST_EXPOSURES * (uint64_t)rig_camera_exposure_us(self, side);
    return wait_until(self, side, started_us, deadline_us, frame);
}

int rig_camera_take_running(struct rig *self, unsigned side, uint64_t not_before_us,
                            struct hal_camera_frame *frame) {
    INVARIANT(side < RIG_SIDES && self->ports.camera[side] != NULL && !self->profile.trigger);
    if (!self->profile.bridge) {
        return rig_camera_wait(self, side, not_before_us, frame);
    }
    struct fpga_bridge_camera before, after;
    int error = rig_camera_choose(self, side);
    if (error == ERROR_OK) {
        error = rig_bridge_used(self, fpga_bridge_camera_read(&self->bridge, side, &before));
    }
    if (error == ERROR_OK) {
        // The port may still hold a frame of the other camera.
        error = rig_camera_wait(self, side, later(not_before_us, rig_now_us(self)), frame);
    }
    if (error != ERROR_OK) {
        return error;
    }
    error = rig_bridge_used(self, fpga_bridge_camera_read(&self->bridge, side, &after));
    if (error != ERROR_OK) {
        raw_image_release(&frame->image);
        return error;
    }
    frame->faults |= rig_camera_counted(&before, &after);
    return ERROR_OK;
}

int rig_camera_check_size(struct rig *self, unsigned side, const struct raw_image *image) {
    if (image->width_px == self->format.width_px && image->height_px == self->format.height_px) {
        return ERROR_OK;
    }
    const int32_t numbers[] = {image->width_px, image->height_px};
    return rig_part_error(self, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_FRAME,
                          "it sends # x # pixels, which is not the requested size (run bringup)",
                          numbers);
}

static const char *describe_torn(uint32_t faults) {
    if ((faults & HAL_CAMERA_SHORT_LINE) != 0) {
        return "two successive frames had lines of wrong length (check its cable)";
    }
    if ((faults & (HAL_CAMERA_SHORT | HAL_CAMERA_LONG)) != 0) {
        return "two successive frames had a wrong number of rows (check its cable)";
    }
    return "two successive frames were damaged (check its cable and plug)";
}

int rig_camera_torn(struct rig *self, unsigned side, uint32_t faults) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_CAMERA, side);
    INVARIANT(faults != 0);
    rig_part_used(self, part, ERROR_FRAME);
    return rig_part_error(self, part, ERROR_FRAME, describe_torn(faults), NULL);
}

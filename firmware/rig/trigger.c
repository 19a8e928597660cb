// SPDX-License-Identifier: Apache-2.0
#include "rig/trigger.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/rig_camera.h"

enum {
    // Time to wait for a frame: this many of the longest frame periods, plus this constant. All
    // attempts together stay below two seconds if frames take 200 ms.
    TIMEOUT_FRAMES = 2,
    TIMEOUT_US = 100000,
    HELD_MAX = 32,  // more frames than a driver can buffer
};

static enum rig_part camera_of(unsigned side) {
    return rig_part_of(RIG_PART_LEFT_CAMERA, side);
}

static int set_line(struct rig *self, bool active) {
    const struct hal_gpio *gpio = self->ports.gpio;
    INVARIANT(self->profile.trigger && gpio != NULL);
    const int error = rig_part_used(self, RIG_PART_TRIGGER_LINE,
                                    gpio->operations->set(gpio->self, HAL_GPIO_TRIGGER, active));
    if (error == ERROR_OK) {
        return ERROR_OK;
    }
    return rig_part_failed(self, RIG_PART_TRIGGER_LINE, error,
                           error == ERROR_UNSUPPORTED
                               ? "there is no trigger line (set trigger_line, or rig.trigger = no)"
                               : "it cannot be driven (check the chip's name and its permissions)");
}

int trigger_rest(struct rig *self) {
    return set_line(self, false);
}

static int failed(struct rig *self, unsigned side, int error) {
    rig_part_used(self, camera_of(side), error);
    return rig_part_failed(self, camera_of(side), error,
                           error == ERROR_DEVICE
                               ? "it is gone (check its plug, then run bringup)"
                               : "no frames from the system (see the system log)");
}

// Deadline for a camera's frame of the last pulse.
static uint64_t deadline_of(const struct rig *self, unsigned side) {
    return self->triggered_us + self->profile.trigger_us +
           TIMEOUT_FRAMES * rig_camera_frame_us(self, side) + TIMEOUT_US;
}

// Waits for a frame that was not complete by `after_us`, in steps so that the observer is called;
// at least once. ERROR_TIMEOUT does not set the message.
static int wait(struct rig *self, unsigned side, uint64_t after_us, uint64_t deadline_us,
                struct hal_camera_frame *frame) {
    const struct hal_camera *camera = self->ports.camera[side];
    for (;;) {
        int error = rig_poll(self);
        if (error != ERROR_OK) {
            return error;
        }
        const uint64_t step_us = rig_now_us(self) + RIG_POLL_US;
        error = camera->operations->take(camera->self, 0,
                                         step_us < deadline_us ? step_us : deadline_us, frame);
        if (error == ERROR_OK && frame->end_us > after_us) {
            return ERROR_OK;
        }
        if (error == ERROR_OK) {
            raw_image_release(&frame->image);
        } else if (error != ERROR_TIMEOUT) {
            return failed(self, side, error);
        }
        if (rig_now_us(self) >= deadline_us) {
            return ERROR_TIMEOUT;
        }
    }
}

// A driver drops frames when its buffers are full, and a camera must read out its last frame before
// it accepts a pulse.
static int drop_held(struct rig *self, unsigned side) {
    uint64_t deadline_us = self->camera[side].frame_pending ? deadline_of(self, side) : 0;
    int error = ERROR_OK;
    for (int held = 0; error == ERROR_OK && held < HELD_MAX; held++) {
        struct hal_camera_frame frame;
        error = wait(self, side, 0, deadline_us, &frame);
        if (error == ERROR_OK) {
            deadline_us = frame.end_us > self->triggered_us ? 0 : deadline_us;
            raw_image_release(&frame.image);
        }
    }
    self->camera[side].frame_pending = false;
    return error == ERROR_TIMEOUT ? ERROR_OK : error;
}

static int drop_all(struct rig *self) {
    int error = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        error = self->camera[side].streaming ? drop_held(self, side) : ERROR_OK;
    }
    return error;
}

int trigger_fire(struct rig *self) {
    int error = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        error = rig_wait_until(self, self->camera[side].settled_at_us);
    }
    if (error != ERROR_OK) {
        return error;
    }
    error = drop_all(self);
    if (error != ERROR_OK) {
        return error;
    }
    self->triggered_us = rig_now_us(self);
    error = set_line(self, true);
    if (error == ERROR_OK) {
        self->camera[RIG_LEFT].frame_pending = self->camera[RIG_RIGHT].frame_pending = true;
        error = rig_wait_until(self, self->triggered_us + self->profile.trigger_us);
    }
    const struct rig_error last_error = self->last_error;
    const int rested = trigger_rest(self);
    if (error == ERROR_OK) {
        return rested;
    }
    self->last_error = last_error;
    return error;
}

int trigger_take(struct rig *self, unsigned side, struct hal_camera_frame *frame) {
    const int error = wait(self, side, self->triggered_us, deadline_of(self, side), frame);
    if (error == ERROR_OK) {
        self->camera[side].frame_pending = false;
        return rig_part_used(self, camera_of(side), error);
    }
    if (error != ERROR_TIMEOUT) {
        return error;
    }
    rig_part_used(self, camera_of(side), error);
    return rig_part_error(self, camera_of(side), error,
                          "no frame after the trigger pulse (set it to external trigger; check its "
                          "wire and trigger_line)",
                          NULL);
}

int trigger_take_one(struct rig *self, unsigned side, struct hal_camera_frame *frame) {
    int error = ERROR_TIMEOUT;
    for (int attempt = 0; attempt < TRIGGER_ATTEMPTS && error == ERROR_TIMEOUT; attempt++) {
        error = trigger_fire(self);
        if (error != ERROR_OK) {
            return error;
        }
        error = trigger_take(self, side, frame);
    }
    return error;
}

int trigger_look(struct rig *self, struct rig_error found[RIG_SIDES]) {
    struct rig_error errors[RIG_SIDES] = {{.error = ERROR_OK}, {.error = ERROR_OK}};
    bool missed = true;
    for (int attempt = 0; attempt < TRIGGER_ATTEMPTS && missed; attempt++) {
        const int error = trigger_fire(self);
        if (error != ERROR_OK) {
            return error;
        }
        missed = false;
        for (unsigned side = 0; side < RIG_SIDES; side++) {
            struct hal_camera_frame frame;
            const int taken =
                self->camera[side].streaming ? trigger_take(self, side, &frame) : ERROR_UNSUPPORTED;
            if (taken == ERROR_CANCELLED) {
                return taken;
            }
            errors[side] = (struct rig_error){.error = ERROR_OK};
            if (taken == ERROR_OK) {
                raw_image_release(&frame.image);
            } else if (self->camera[side].streaming) {
                errors[side] = self->last_error;
            }
            missed = missed || errors[side].error == ERROR_TIMEOUT;
        }
    }
    found[RIG_LEFT] = errors[RIG_LEFT];
    found[RIG_RIGHT] = errors[RIG_RIGHT];
    return ERROR_OK;
}

int trigger_check_quiet(struct rig *self) {
    int error = drop_all(self);
    const uint64_t begin_us = rig_now_us(self);
    const uint64_t end_us = begin_us + (uint64_t)TIMEOUT_FRAMES * self->profile.frame_us;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        struct hal_camera_frame frame;
        error = wait(self, side, begin_us, end_us, &frame);
        if (error == ERROR_OK) {
            raw_image_release(&frame.image);
            rig_part_used(self, camera_of(side), ERROR_VERIFY);
            return rig_part_error(self, camera_of(side), ERROR_VERIFY,
                                  "it sends frames without a trigger pulse (set it to external "
                                  "trigger, or rig.trigger = no)",
                                  NULL);
        }
        error = error == ERROR_TIMEOUT ? ERROR_OK : error;
    }
    return error;
}

int rig_camera_take(struct rig *self, unsigned side, uint64_t not_before_us,
                    struct hal_camera_frame *frame) {
    return self->profile.trigger ? trigger_take_one(self, side, frame)
                                 : rig_camera_take_running(self, side, not_before_us, frame);
}

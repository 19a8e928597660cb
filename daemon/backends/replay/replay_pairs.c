// SPDX-License-Identifier: Apache-2.0
// Replay of pairs only: both cameras show a pair's frames repeatedly until it is captured, then the
// next pair's. Time starts at the first pair and advances by waits and frames. Frames have the
// recorded duration and offset within the pair, unless later frames are requested.
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/replay/replay.h"

static uint64_t later(uint64_t a, uint64_t b) {
    return a > b ? a : b;
}

static uint64_t now_us(void *context) {
    return ((const struct replay *)context)->now_us;
}

static void wait_until_us(void *context, uint64_t time_us) {
    struct replay *self = context;
    self->now_us = later(self->now_us, time_us);
}

static bool idle_is_due(void *context) {
    (void)context;
    return false;
}

static const struct hal_clock_operations clock_operations = {now_us, wait_until_us, idle_is_due};

static int start(void *context, const struct hal_camera_format *format) {
    const struct replay_camera *camera = context;
    const struct replay *self = camera->replay;
    const struct pair_frame *first = &self->pairs[0].pair.frame[camera->number];
    const bool fits =
        format->width_px == first->image.width_px && format->height_px == first->image.height_px;
    return fits ? 0 : ERROR_UNSUPPORTED;
}

static int stop(void *context) {
    (void)context;
    return 0;
}

/// Of a merged frame, which took as long as all its frames, that of one.
static uint64_t duration_of(const struct pair_frame *frame) {
    uint64_t frames = frame->parts == 0;
    for (int i = 0; i < frame->parts; i++) {
        frames += frame->part[i].frames;
    }
    INVARIANT(frames > 0);
    return (frame->end_us - frame->begin_us) / frames;
}

/// Start of the next frame: not before the requested time or the end of the camera's last frame;
/// the right frame keeps its recorded offset to the left one if possible.
static uint64_t begin_of(const struct replay_camera *camera, const struct session_event *event,
                         uint64_t not_before_us) {
    const struct replay *self = camera->replay;
    const struct pair_frame *frames = event->pair.frame;
    const uint64_t min_us = later(not_before_us, camera->end_us);
    const struct replay_camera *left = &self->camera_state[RIG_LEFT];
    if (camera->number == RIG_LEFT || frames[RIG_RIGHT].parts > 0 ||
        left->of_pair != self->next_pair + 1) {
        return min_us;
    }
    const uint64_t skew_us = frames[RIG_RIGHT].begin_us - frames[RIG_LEFT].begin_us;
    const uint64_t begin_us = left->begin_us + skew_us;
    return begin_us >= not_before_us && begin_us >= camera->end_us ? begin_us : min_us;
}

/// Shows the next pair if the rig has captured one.
static void look_at_rig(struct replay *self) {
    const uint32_t pairs = self->rig != NULL ? self->rig->pairs : 0;
    INVARIANT(self->next_pair <= self->pair_count);
    if (pairs > self->pairs_of_rig && self->next_pair < self->pair_count) {
        self->next_pair++;
    }
    self->pairs_of_rig = pairs;
}

static int take(void *context, uint64_t not_before_us, uint64_t deadline_us,
                struct hal_camera_frame *frame) {
    struct replay_camera *camera = context;
    struct replay *self = camera->replay;
    look_at_rig(self);
    if (self->next_pair >= self->pair_count) {
        self->now_us = later(self->now_us, deadline_us);
        camera->counts.timeouts++;
        return message_set(&self->last_error, ERROR_TIMEOUT,
                           "%s: all %u recorded pairs were delivered", self->session.path,
                           self->pair_count);
    }
    const struct session_event *event = &self->pairs[self->next_pair];
    const struct pair_frame *form = &event->pair.frame[camera->number];
    const uint64_t begin_us = begin_of(camera, event, not_before_us);
    const uint64_t end_us = begin_us + duration_of(form);
    if (end_us > later(deadline_us, self->now_us)) {
        self->now_us = later(self->now_us, deadline_us);
        camera->counts.timeouts++;
        return ERROR_TIMEOUT;
    }
    const int code = replay_frame(camera, form, event->frame_crc[camera->number], frame);
    if (code != 0) {
        return code;
    }
    frame->begin_us = camera->begin_us = begin_us;
    frame->end_us = camera->end_us = end_us;
    frame->sequence = camera->sequence++;
    self->now_us = later(self->now_us, end_us);
    camera->of_pair = self->next_pair + 1;
    camera->counts.frames++;
    return ERROR_OK;
}

/// Frames have the recorded settings, whatever is requested; nothing is automatic, and there is no
/// focus control.
static int control(void *context, enum hal_camera_control control, int32_t value,
                   int32_t *applied) {
    const struct replay_camera *camera = context;
    const struct replay *self = camera->replay;
    INVARIANT(self->pair_count > 0);
    const uint32_t last = self->pair_count - 1;
    const uint32_t at = self->next_pair < last ? self->next_pair : last;
    const uint32_t exposure_us = self->pairs[at].pair.frame[camera->number].exposure_us;
    *applied = control == HAL_CAMERA_EXPOSURE_US ? (int32_t)exposure_us : value;
    return 0;
}

static void counts(void *context, struct hal_camera_counts *result) {
    *result = ((const struct replay_camera *)context)->counts;
}

static const struct hal_camera_operations camera_operations = {start, stop, take, control, counts};

int replay_add_pair(struct replay *self, struct message *message) {
    const struct session_event *event = &self->event;
    INVARIANT(event->kind == SESSION_PAIR && !self->has_calls);
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct pair_frame *frame = &event->pair.frame[side];
        if (frame->end_us < frame->begin_us) {
            return message_set(message, ERROR_RANGE, "%s: pair %u ends before it starts",
                               self->session.path, event->pair.number);
        }
    }
    struct session_event *more =
        realloc(self->pairs, (self->pair_count + (size_t)1) * sizeof *more);
    if (more == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", self->session.path);
    }
    self->pairs = more;
    self->pairs[self->pair_count++] = *event;
    return ERROR_OK;
}

int replay_pairs_open(struct replay *self, struct message *message) {
    if (self->pair_count == 0) {
        return message_set(message, ERROR_MISSING, "%s: contains neither calls nor pairs to replay",
                           self->session.path);
    }
    const struct pair_frame *first = self->pairs[0].pair.frame;
    self->now_us = first[first[RIG_RIGHT].begin_us < first[RIG_LEFT].begin_us].begin_us;
    self->clock = (struct hal_clock){&clock_operations, self};
    self->ports.clock = &self->clock;
    for (int side = 0; side < RIG_SIDES; side++) {
        self->camera_operations[side] = camera_operations;
        self->ports.camera[side] = &self->camera[side];
    }
    return ERROR_OK;
}

// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/sim/sim_camera.h"

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/sim/sim_bytes.h"
#include "daemon/base/raw_memory.h"

enum { FRAME_HEAD = 28, SENSOR_BITS = 10 };

static int cancel(struct sim_camera *self) {
    if (!self->armed) {
        return ERROR_OK;
    }
    self->armed = false;
    struct sim_exchange request = {.type = SIMRIG_FRAME_CANCEL};
    return sim_connection_require(self->connection, &request);
}

static int start(void *context, const struct hal_camera_format *format) {
    struct sim_camera *self = context;
    if (format->width_px < 1 || format->height_px < 1 ||
        (size_t)format->width_px * format->height_px > self->max_px) {
        return ERROR_UNSUPPORTED;
    }
    const int error = cancel(self);
    self->format = *format;
    self->started = error == ERROR_OK;
    return error;
}

static int stop(void *context) {
    struct sim_camera *self = context;
    self->started = false;
    return cancel(self);
}

static int arm(struct sim_camera *self) {
    uint8_t body[4];
    sim_bytes_put_u16(body, self->format.width_px);
    sim_bytes_put_u16(body + 2, self->format.height_px);
    struct sim_exchange request = {.type = SIMRIG_FRAME_ARM, .body = body, .bytes = sizeof body};
    const int error = sim_connection_require(self->connection, &request);
    self->armed = error == ERROR_OK;
    return error;
}

// Waits before arming, as no earlier frame is wanted: frames that pass an armed port are rendered
// pixel by pixel.
static int wait_until(struct sim_camera *self, uint64_t not_before_us, uint64_t deadline_us) {
    const uint64_t until_us = not_before_us < deadline_us ? not_before_us : deadline_us;
    if (until_us <= self->connection->now_us) {
        return ERROR_OK;
    }
    const int error = sim_connection_advance(self->connection, until_us, 0, NULL);
    return error == ERROR_OK && until_us < not_before_us ? ERROR_TIMEOUT : error;
}

static uint32_t faults_of(uint32_t reported) {
    return ((reported & SIMRIG_FRAME_SHORT_LINE) != 0 ? HAL_CAMERA_SHORT_LINE : 0u) |
           ((reported & SIMRIG_FRAME_SHORT) != 0 ? HAL_CAMERA_SHORT : 0u) |
           ((reported & SIMRIG_FRAME_LONG) != 0 ? HAL_CAMERA_LONG : 0u);
}

// Waits for the armed frame and receives it into its image, whose memory is allocated.
static int fetch(struct sim_camera *self, uint64_t deadline_us, uint16_t *memory,
                 struct hal_camera_frame *frame) {
    const size_t values = (size_t)self->format.width_px * self->format.height_px;
    INVARIANT(self->armed && frame->image.data == memory);
    uint8_t body[8], head[FRAME_HEAD];
    sim_connection_put_us(self->connection, body, deadline_us);
    struct sim_exchange wait = {.type = SIMRIG_FRAME_WAIT,
                                .body = body,
                                .bytes = sizeof body,
                                .head = head,
                                .head_bytes = sizeof head,
                                .rest = (uint8_t *)memory,
                                .rest_capacity = values * sizeof memory[0]};
    const int error = sim_connection_run(self->connection, &wait);
    if (error != ERROR_OK) {
        return error;
    }
    if (wait.status == SIMRIG_DEADLINE) {
        return ERROR_TIMEOUT;
    }
    self->armed = false;
    if (wait.status != SIMRIG_OK || wait.rest_bytes != values * sizeof memory[0] ||
        sim_bytes_u16(head + 20) != self->format.width_px ||
        sim_bytes_u16(head + 22) != self->format.height_px) {
        return ERROR_IO;
    }
    for (size_t i = 0; i < values; i++) {
        memory[i] = sim_bytes_u16(wait.rest + 2 * i);
    }
    frame->sequence = sim_bytes_u32(head + 16);
    frame->faults = faults_of(sim_bytes_u32(head + 24));
    frame->begin_us = sim_connection_reported_us(self->connection, head);
    frame->end_us = sim_connection_reported_us(self->connection, head + 8);
    return ERROR_OK;
}

static int take(void *context, uint64_t not_before_us, uint64_t deadline_us,
                struct hal_camera_frame *frame) {
    struct sim_camera *self = context;
    if (!self->started) {
        return ERROR_UNSUPPORTED;
    }
    struct hal_camera_frame got = {.image = {.width_px = self->format.width_px,
                                             .height_px = self->format.height_px,
                                             .bits = SENSOR_BITS,
                                             .layout = RAW_BAYER_GRBG}};
    uint16_t *memory = raw_memory_allocate(&got.image);
    int error = memory != NULL ? ERROR_OK : ERROR_MEMORY;
    do {
        if (error == ERROR_OK && !self->armed) {
            error = wait_until(self, not_before_us, deadline_us);
            error = error == ERROR_OK ? arm(self) : error;
        }
        if (error == ERROR_OK) {
            error = fetch(self, deadline_us, memory, &got);
        }
    } while (error == ERROR_OK && got.begin_us < not_before_us);
    if (error != ERROR_OK) {
        raw_image_release(&got.image);
        self->counts.timeouts += error == ERROR_TIMEOUT;
        return error;
    }
    self->counts.frames++;
    self->counts.faulty += got.faults != 0;
    *frame = got;
    return ERROR_OK;
}

static void counts(void *context, struct hal_camera_counts *out) {
    const struct sim_camera *self = context;
    *out = self->counts;
}

struct hal_camera sim_camera_hal(struct sim_camera *self) {
    static const struct hal_camera_operations operations = {start, stop, take, NULL, counts};
    return (struct hal_camera){&operations, self};
}

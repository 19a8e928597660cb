// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/v4l2_camera.h"

#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/device_file.h"
#include "daemon/backends/linux/monotonic_clock.h"
#include "daemon/backends/linux/v4l2_control.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/raw_memory.h"

enum {
    RESTARTS_MAX = 3,         // maximum number of restarts in one call
    PAUSE_US = 20000,         // pause before the second restart in a row; doubled before the third
    MISSED_FRAMES = 3,        // the stream is broken after this many frame times without a frame
    MISSED_US = 100000,       // shortest time after which the stream is considered broken
    FIRST_FRAME_US = 2000000  // webcams take this long to start
};

static void report(const struct v4l2_camera *self, enum hal_log_level level, const char *what) {
    if (self->log != NULL) {
        char text[sizeof self->path + sizeof self->stream.last_error.text + 64];
        snprintf(text, sizeof text, "camera %s: %s", self->path, what);
        self->log->operations->write(self->log->self, level, text);
    }
}

/// Longest frame interval; a longer exposure extends it.
static uint32_t frame_time_us(const struct v4l2_camera *self) {
    const uint32_t reported_us =
        self->stream.frame_us > self->frame_us ? self->stream.frame_us : self->frame_us;
    return reported_us > self->exposure_us ? reported_us : self->exposure_us;
}

/// Time limit for the next frame after a frame.
static uint32_t default_timeout_us(const struct v4l2_camera *self) {
    const uint64_t timeout_us = (uint64_t)MISSED_FRAMES * frame_time_us(self);
    if (timeout_us < MISSED_US) {
        return MISSED_US;
    }
    return timeout_us > UINT32_MAX ? UINT32_MAX : (uint32_t)timeout_us;
}

/// Resets numbering after a stream start; the first frame may take long.
static void begin_waiting(struct v4l2_camera *self) {
    self->has_sequence = false;
    self->alive_us = monotonic_now_us();
    const uint32_t default_us = default_timeout_us(self);
    self->timeout_us = default_us > FIRST_FRAME_US ? default_us : FIRST_FRAME_US;
}

/// The same for a stream that was interrupted: the number of lost frames is unknown, but at least
/// one.
static void begin_after_gap(struct v4l2_camera *self) {
    begin_waiting(self);
    self->sequence++;
    self->counts.gaps++;
}

/// Reopens an unplugged camera: plugged in again it is another file of the same name.
static int open_again(struct v4l2_camera *self, struct message *message) {
    v4l2_stream_close(&self->stream);
    self->exposure_us = 0;
    const int error = v4l2_stream_open(&self->stream, self->path, message);
    self->gone = error != ERROR_OK;
    return error;
}

static int stop(void *opaque) {
    struct v4l2_camera *self = opaque;
    if (!self->started) {
        return ERROR_OK;
    }
    self->started = false;
    const int error = v4l2_stream_off(&self->stream);
    self->gone = self->gone || error == ERROR_DEVICE;
    return error;
}

static bool is_streaming(const struct v4l2_camera *self, const struct hal_camera_format *format) {
    return !self->gone && self->started && self->stream.on &&
           self->format.width_px == format->width_px && self->format.height_px == format->height_px;
}

/// Reopens an unplugged camera; an error is logged.
static int find_again(struct v4l2_camera *self) {
    struct message message;
    const int error = open_again(self, &message);
    if (error != ERROR_OK && self->log != NULL) {
        self->log->operations->write(self->log->self, HAL_LOG_ERROR, message.text);
    }
    return error;
}

static int start(void *opaque, const struct hal_camera_format *format) {
    struct v4l2_camera *self = opaque;
    if (format->width_px == 0 || format->height_px == 0) {
        return ERROR_UNSUPPORTED;
    }
    if (is_streaming(self, format)) {
        return ERROR_OK;
    }
    self->refused.text[0] = '\0';
    int error = stop(self);
    if (self->gone) {
        error = find_again(self);
        if (error != ERROR_OK) {
            return error;
        }
    }
    if (error == ERROR_OK) {
        error = v4l2_stream_start(&self->stream, format);
    }
    if (error != ERROR_OK) {
        self->gone = self->gone || error == ERROR_DEVICE;
        self->refused = self->stream.last_error;
        report(self, HAL_LOG_ERROR, self->stream.last_error.text);
        return error;
    }
    self->started = true;
    self->format = *format;
    begin_waiting(self);
    return ERROR_OK;
}

/// Reports the stream's last error and what follows from it.
static void report_broken(const struct v4l2_camera *self, enum hal_log_level level,
                          const char *then) {
    char text[sizeof self->stream.last_error.text + 40];
    snprintf(text, sizeof text, "%s; %s", self->stream.last_error.text, then);
    report(self, level, text);
}

/// Restarts a broken stream. `tries` counts the attempts of this call; the first needs no time, so
/// that a stream that breaks at the deadline delivers frames to the next call.
static int restart(struct v4l2_camera *self, uint64_t deadline_us, int *tries) {
    int error = ERROR_IO;
    while (error != ERROR_OK) {
        if (*tries == RESTARTS_MAX) {
            report_broken(self, HAL_LOG_ERROR, "giving up for now");
            return ERROR_IO;
        }
        const uint64_t pause_us = *tries == 0 ? 0 : (uint64_t)PAUSE_US << (*tries - 1);
        const uint64_t until_us = monotonic_now_us() + pause_us;
        if (pause_us > 0 && until_us >= deadline_us) {
            monotonic_clock_wait_until_us(deadline_us);
            return ERROR_TIMEOUT;
        }
        report_broken(self, HAL_LOG_WARNING, "restarting the stream");
        monotonic_clock_wait_until_us(until_us);
        ++*tries;
        self->counts.restarts++;
        if (self->stream.on) {
            (void)v4l2_stream_off(&self->stream);
        }
        error = v4l2_stream_on(&self->stream);
        if (error == ERROR_DEVICE || error == ERROR_UNSUPPORTED) {
            report(self, HAL_LOG_ERROR, self->stream.last_error.text);
            return error;
        }
    }
    begin_after_gap(self);
    return ERROR_OK;
}

/// Waits for the driver's next buffer, across restarts.
static int next_filled(struct v4l2_camera *self, uint64_t deadline_us, int *tries,
                       struct v4l2_stream_filled *filled) {
    for (;;) {
        int error = ERROR_IO;
        if (self->stream.on) {
            const uint64_t lost_us =
                self->triggered ? UINT64_MAX : self->alive_us + self->timeout_us;
            error = v4l2_stream_next(&self->stream, lost_us < deadline_us ? lost_us : deadline_us,
                                     filled);
            if (error == ERROR_TIMEOUT && lost_us < deadline_us) {
                // The driver may need more buffers than lent frames leave it.
                const unsigned left = v4l2_stream_left(&self->stream);
                self->stream.copies = self->stream.copies ||
                                      (left < V4L2_STREAM_BUFFERS_MIN && left < self->stream.count);
                message_set(&self->stream.last_error, 0, "no frame for %u ms",
                            self->timeout_us / 1000);
                error = ERROR_IO;
            }
        }
        if (error != ERROR_IO) {
            if (error == ERROR_DEVICE) {
                report(self, HAL_LOG_ERROR, self->stream.last_error.text);
            }
            return error;
        }
        error = restart(self, deadline_us, tries);
        if (error != ERROR_OK) {
            return error;
        }
    }
}

/// Numbers the frame and counts the missing frames before it. A driver that does not count
/// (constant number) yields no gaps.
static void count_frame(struct v4l2_camera *self, uint32_t driver_sequence) {
    const uint32_t step = self->has_sequence ? driver_sequence - self->driver_sequence : 1;
    const bool advances = step != 0 && step < UINT32_C(0x80000000);
    self->counts.gaps += advances ? step - 1 : 0;
    self->sequence += advances ? step : 1;
    self->driver_sequence = driver_sequence;
    self->has_sequence = true;
}

static uint64_t subtract_us(uint64_t time_us, uint64_t interval_us) {
    return time_us > interval_us ? time_us - interval_us : 0;
}

/// Sets the times of the first and last pixel; the first is never too late, see the header.
static void set_times(const struct v4l2_camera *self, const struct v4l2_stream_filled *filled,
                      uint64_t now_us, struct hal_camera_frame *frame) {
    // A readout takes at most the frame interval that the driver reports.
    const uint64_t frame_us = self->stream.frame_us > 0 ? self->stream.frame_us : self->frame_us;
    if (filled->has_time && filled->time_us <= now_us) {
        // A row is read out only after its exposure.
        const uint64_t whole_after_us = filled->time_begins ? frame_us + self->exposure_us : 0;
        const uint64_t end_us = filled->time_us + whole_after_us;
        frame->end_us = end_us < now_us ? end_us : now_us;
        frame->begin_us =
            filled->time_begins ? filled->time_us : subtract_us(filled->time_us, frame_us);
        return;
    }
    // Complete after its buffer was queued; only now, if no buffer was ready before.
    const uint64_t whole_us =
        filled->waited ? now_us : self->stream.buffers[filled->index].queued_us;
    frame->end_us = now_us;
    frame->begin_us = subtract_us(whole_us, frame_us);
}

/// Makes an image of the driver's buffer: in it, or the frame's only copy.
static int convert(struct v4l2_camera *self, const struct v4l2_stream_filled *filled,
                   struct hal_camera_frame *frame) {
    const struct v4l2_pixels *format = self->stream.format;
    frame->image = (struct raw_image){.width_px = self->format.width_px,
                                      .height_px = self->format.height_px,
                                      .bits = format->bits,
                                      .layout = format->layout};
    uint16_t *pixels = self->stream.lends
                           ? v4l2_stream_lend(&self->stream, filled->index, &frame->image)
                           : raw_memory_allocate(&frame->image);
    if (pixels == NULL) {
        report(self, HAL_LOG_ERROR, "out of memory for its frames (try smaller frames)");
        return ERROR_MEMORY;
    }
    frame->faults = v4l2_pixels_convert(format, &filled->pixels, pixels, frame->image.stride);
    frame->faults |= filled->damaged ? HAL_CAMERA_DAMAGED : 0;
    frame->sequence = self->sequence;
    self->counts.frames++;
    self->counts.faulty += frame->faults != 0;
    return ERROR_OK;
}

/// Returns a buffer to the driver. If the driver refuses it the stream is broken, and is restarted
/// before the next frame.
static int requeue(struct v4l2_camera *self, unsigned index) {
    if (v4l2_stream_is_lent(&self->stream, index)) {
        return ERROR_OK;  // queued by `supply` when its frame is gone
    }
    const int error = v4l2_stream_queue(&self->stream, index);
    if (error == ERROR_IO) {
        const struct message last_error = self->stream.last_error;
        (void)v4l2_stream_off(&self->stream);
        self->stream.last_error = last_error;
        return ERROR_OK;
    }
    return error;
}

/// Gives the driver the buffers of frames that are gone; new ones if it has none.
static int requeue_free_buffers(struct v4l2_camera *self) {
    struct v4l2_stream *stream = &self->stream;
    unsigned queued = 0;
    int error = ERROR_OK;
    for (unsigned i = 0; error == ERROR_OK && i < stream->count; i++) {
        error = stream->buffers[i].queued ? ERROR_OK : requeue(self, i);
        queued += stream->buffers[i].queued;
    }
    if (error != ERROR_OK || queued > 0 || !stream->on) {
        return error;
    }
    error = v4l2_stream_renew(stream);
    if (error == ERROR_OK) {
        begin_after_gap(self);
    } else if (error == ERROR_MEMORY) {
        report(self, HAL_LOG_ERROR, stream->last_error.text);
    }
    return error == ERROR_IO ? ERROR_OK : error;  // it is restarted
}

static int take_one(struct v4l2_camera *self, uint64_t not_before_us, uint64_t deadline_us,
                    struct hal_camera_frame *frame) {
    int tries = 0;
    const int supplied = requeue_free_buffers(self);
    if (supplied != ERROR_OK) {
        return supplied;
    }
    for (;;) {
        struct v4l2_stream_filled filled;
        int error = next_filled(self, deadline_us, &tries, &filled);
        if (error != ERROR_OK) {
            return error;
        }
        const uint64_t now_us = monotonic_now_us();
        self->alive_us = now_us;
        self->timeout_us = default_timeout_us(self);
        count_frame(self, filled.sequence);
        struct hal_camera_frame got = {.faults = 0};
        set_times(self, &filled, now_us, &got);
        const bool late_enough = got.begin_us >= not_before_us;
        const int converted = late_enough ? convert(self, &filled, &got) : ERROR_OK;
        error = requeue(self, filled.index);
        if (late_enough) {
            // The frame is complete; the next call reports a device that has gone since.
            *frame = got;
            return converted;
        }
        if (error != ERROR_OK || monotonic_now_us() >= deadline_us) {
            return error != ERROR_OK ? error : ERROR_TIMEOUT;
        }
    }
}

static int take(void *opaque, uint64_t not_before_us, uint64_t deadline_us,
                struct hal_camera_frame *frame) {
    struct v4l2_camera *self = opaque;
    INVARIANT(self->started);
    const uint64_t idle_from_us =
        self->returned_us > self->alive_us ? self->returned_us : self->alive_us;
    self->alive_us += monotonic_now_us() - idle_from_us;
    const int error = take_one(self, not_before_us, deadline_us, frame);
    self->returned_us = monotonic_now_us();
    self->counts.timeouts += error == ERROR_TIMEOUT;
    self->gone = self->gone || error == ERROR_DEVICE;
    return error;
}

static int control(void *opaque, enum hal_camera_control which, int32_t value, int32_t *applied) {
    struct v4l2_camera *self = opaque;
    if (self->stream.fd < 0) {
        return ERROR_DEVICE;
    }
    const int error = v4l2_control_set(self->stream.fd, which, value, applied);
    if (error == ERROR_OK &&
        (which == HAL_CAMERA_EXPOSURE_US || which == HAL_CAMERA_EXPOSURE_FOUND_US)) {
        self->exposure_us = *applied > 0 ? (uint32_t)*applied : 0;
        const uint32_t default_us = default_timeout_us(self);
        self->timeout_us = default_us > self->timeout_us ? default_us : self->timeout_us;
    }
    return error;
}

static void counts(void *opaque, struct hal_camera_counts *into) {
    const struct v4l2_camera *self = opaque;
    *into = self->counts;
}

void v4l2_camera_init(struct v4l2_camera *self, const char *path, uint32_t frame_us,
                      const struct hal_log *log) {
    static const struct hal_camera_operations operations = {start, stop, take, control, counts};
    INVARIANT(frame_us > 0);
    *self = (struct v4l2_camera){.hal = {&operations, self},
                                 .stream = {.fd = -1},
                                 .log = log,
                                 .frame_us = frame_us,
                                 .gone = true};
    snprintf(self->path, sizeof self->path, "%s", path);
}

int v4l2_camera_open(struct v4l2_camera *self, const char *path, uint32_t frame_us,
                     const struct hal_log *log, struct message *message) {
    v4l2_camera_init(self, path, frame_us, log);
    return open_again(self, message);
}

int v4l2_camera_renew(struct v4l2_camera *self, struct message *message) {
    if (!self->gone && device_file_is_current(self->stream.fd, self->path)) {
        return ERROR_OK;
    }
    (void)stop(self);
    return open_again(self, message);
}

void v4l2_camera_close(struct v4l2_camera *self) {
    v4l2_stream_close(&self->stream);
    self->started = false;
}

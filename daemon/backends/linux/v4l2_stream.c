// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/v4l2_stream.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/device_file.h"
#include "daemon/backends/linux/monotonic_clock.h"
#include "daemon/base/memory.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/raw_memory.h"

// After this many `ready` results of poll without a buffer the driver is considered faulty.
enum { EMPTY_ANSWERS_MAX = 8 };

// Frames that should have room beside the driver's buffers.
enum { FRAMES_BESIDE = 6 };

static const double bytes_per_mb = 1e6;

struct v4l2_stream_mapping {
    void *data;
    size_t bytes;
    atomic_uint users;  // the stream, and an image
};

static void end_use(void *owner) {
    struct v4l2_stream_mapping *mapping = owner;
    if (atomic_fetch_sub(&mapping->users, 1) == 1) {
        munmap(mapping->data, mapping->bytes);
        free(mapping);
    }
}

/// Records what failed and returns the error for errno.
static int fail(struct v4l2_stream *self, const char *what) {
    const int error = device_file_error(errno);
    // Only this code sets deadlines: a driver's ETIMEDOUT is a broken stream.
    return message_set(&self->last_error, error == ERROR_TIMEOUT ? ERROR_IO : error, "%s: %s", what,
                       strerror(errno));
}

/// Copies a driver's text; non-printable characters become '?'.
static void copy_name(char *name, size_t bytes, const uint8_t *reported) {
    size_t length = 0;
    while (length + 1 < bytes && reported[length] != '\0') {
        const bool printable = reported[length] >= ' ' && reported[length] <= '~';
        name[length] = printable ? (char)reported[length] : '?';
        length++;
    }
    name[length] = '\0';
}

int v4l2_stream_open(struct v4l2_stream *self, const char *path, struct message *message) {
    *self = (struct v4l2_stream){.fd = -1};
    const int fd = device_file_open(path, O_RDWR | O_NONBLOCK, "camera", message);
    if (fd < 0) {
        return fd;
    }
    self->fd = fd;
    struct v4l2_capability ability = {.capabilities = 0};
    int error = ERROR_OK;
    if (device_file_control(fd, VIDIOC_QUERYCAP, &ability) < 0) {
        const bool other = errno == ENOTTY || errno == EINVAL;
        error = message_set(message, other ? ERROR_UNSUPPORTED : device_file_error(errno),
                            "camera %s: %s", path,
                            other ? "not a V4L2 device (expected /dev/videoN)" : strerror(errno));
    } else {
        const uint32_t can = (ability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                 ? ability.device_caps
                                 : ability.capabilities;
        copy_name(self->driver, sizeof self->driver, ability.driver);
        copy_name(self->card, sizeof self->card, ability.card);
        copy_name(self->bus, sizeof self->bus, ability.bus_info);
        const uint32_t needed = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        if ((can & needed) != needed) {
            error = message_set(message, ERROR_UNSUPPORTED,
                                "camera %s (%.31s) does not stream images (a camera often has two "
                                "devices: try the next lower number)",
                                path, self->card);
        }
    }
    if (error != ERROR_OK) {
        device_file_close(&self->fd);
    }
    return error;
}

void v4l2_stream_close(struct v4l2_stream *self) {
    if (self->fd >= 0) {
        (void)v4l2_stream_off(self);
        device_file_close(&self->fd);
    }
}

/// Whether rows of this length fit the sizes that the driver reports.
static bool is_layout_possible(const struct v4l2_pixels *format,
                               const struct v4l2_pix_format *pix) {
    const uint64_t row = v4l2_pixels_row_bytes(format, pix->width);
    return pix->sizeimage > 0 &&
           (format->bytes_per_pixel == 0 ||
            (pix->bytesperline >= row &&
             (uint64_t)pix->bytesperline * (pix->height - 1) + row <= pix->sizeimage));
}

/// Requests frames of this kind. False if the camera does not have them; errno is then 0, or the
/// error. `*nearest` is the size the camera offers instead, if it reports one.
static bool set_format(struct v4l2_stream *self, const struct v4l2_pixels *format,
                       const struct hal_camera_format *wanted, struct hal_camera_format *nearest) {
    struct v4l2_format request = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    struct v4l2_pix_format *pix = &request.fmt.pix;
    pix->width = wanted->width_px;
    pix->height = wanted->height_px;
    pix->pixelformat = format->fourcc;
    pix->field = V4L2_FIELD_NONE;
    if (device_file_control(self->fd, VIDIOC_S_FMT, &request) < 0) {
        // Older drivers return EINVAL for unknown formats.
        errno = errno == EINVAL ? 0 : errno;
        return false;
    }
    errno = 0;
    if (pix->pixelformat != format->fourcc || pix->field != V4L2_FIELD_NONE || pix->width == 0 ||
        pix->width > UINT16_MAX || pix->height == 0 || pix->height > UINT16_MAX ||
        !is_layout_possible(format, pix)) {
        return false;
    }
    if (pix->width != wanted->width_px || pix->height != wanted->height_px) {
        *nearest = (struct hal_camera_format){(uint16_t)pix->width, (uint16_t)pix->height};
        return false;
    }
    self->format = format;
    self->buffer_bytes = pix->sizeimage;
    self->layout = (struct v4l2_pixels_source){
        .bytes_per_line = pix->bytesperline,
        .width_px = wanted->width_px,
        .height_px = wanted->height_px,
        .full_range = pix->quantization == V4L2_QUANTIZATION_FULL_RANGE};
    return true;
}

/// The frame interval, if the driver reports it.
static uint32_t frame_time_us(const struct v4l2_stream *self) {
    struct v4l2_streamparm parameters = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    const struct v4l2_captureparm *capture = &parameters.parm.capture;
    if (device_file_control(self->fd, VIDIOC_G_PARM, &parameters) < 0 ||
        (capture->capability & V4L2_CAP_TIMEPERFRAME) == 0 ||
        capture->timeperframe.denominator == 0) {
        return 0;
    }
    const uint64_t us =
        (uint64_t)capture->timeperframe.numerator * 1000000 / capture->timeperframe.denominator;
    return us <= 60000000 ? (uint32_t)us : 0;
}

static void clear_buffer(struct v4l2_buffer *buffer, unsigned index) {
    memset(buffer, 0, sizeof *buffer);
    buffer->type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer->memory = V4L2_MEMORY_MMAP;
    buffer->index = index;
}

static int request_buffers(struct v4l2_stream *self, unsigned count, unsigned *given) {
    struct v4l2_requestbuffers request = {
        .count = count, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    if (device_file_control(self->fd, VIDIOC_REQBUFS, &request) < 0) {
        return fail(self, "REQBUFS");
    }
    *given = request.count;
    // A driver that does not keep what is mapped refuses to release it.
    self->lends = count > 0 && !self->copies && v4l2_pixels_fit(self->format, &self->layout) &&
                  (request.capabilities & V4L2_BUF_CAP_SUPPORTS_ORPHANED_BUFS) != 0;
    return ERROR_OK;
}

static int map_buffer(struct v4l2_stream *self, unsigned index) {
    struct v4l2_buffer buffer;
    clear_buffer(&buffer, index);
    if (device_file_control(self->fd, VIDIOC_QUERYBUF, &buffer) < 0) {
        return fail(self, "QUERYBUF");
    }
    const struct v4l2_pixels_source *layout = &self->layout;
    const size_t row = v4l2_pixels_row_bytes(self->format, layout->width_px);
    const size_t min = (size_t)layout->bytes_per_line * (layout->height_px - 1U) + row;
    if (self->format->bytes_per_pixel != 0 && buffer.length < min) {
        return message_set(&self->last_error, ERROR_IO,
                           "the driver's buffers have %u bytes, a frame needs %zu", buffer.length,
                           min);
    }
    struct v4l2_stream_mapping *mapping = malloc(sizeof *mapping);
    if (mapping == NULL) {
        return message_set(&self->last_error, ERROR_MEMORY, "out of memory");
    }
    void *data = mmap(NULL, buffer.length, self->lends ? PROT_READ | PROT_WRITE : PROT_READ,
                      MAP_SHARED, self->fd, (off_t)buffer.m.offset);
    if (data == MAP_FAILED) {
        free(mapping);
        return errno == ENODEV || errno == EINVAL || errno == ENOSYS || errno == EPERM
                   ? message_set(&self->last_error, ERROR_UNSUPPORTED,
                                 "cannot map its memory: %s (without an MMU the driver must "
                                 "support get_unmapped_area)",
                                 strerror(errno))
                   : fail(self, "mmap");
    }
    mapping->data = data;
    mapping->bytes = buffer.length;
    atomic_init(&mapping->users, 1);
    self->buffers[index] =
        (struct v4l2_stream_buffer){.data = data, .bytes = buffer.length, .mapping = mapping};
    self->count = index + 1;
    return ERROR_OK;
}

int v4l2_stream_queue(struct v4l2_stream *self, unsigned index) {
    INVARIANT(index < self->count && !self->buffers[index].queued);
    struct v4l2_buffer buffer;
    clear_buffer(&buffer, index);
    if (device_file_control(self->fd, VIDIOC_QBUF, &buffer) < 0) {
        return fail(self, "QBUF");
    }
    self->buffers[index].queued = true;
    self->buffers[index].queued_us = monotonic_now_us();
    return ERROR_OK;
}

/// As many buffers as leave room for other frames: the last pair, one being taken, and files in
/// memory or a surface. Fewer than the minimum: not even so many fit, without which the driver has
/// no room for the next frame.
static unsigned count_buffers(const struct v4l2_stream *self, uint64_t free_bytes) {
    const uint64_t buffer_bytes = self->buffer_bytes;
    const uint64_t frame_bytes = v4l2_pixels_row_values(self->format, self->layout.width_px) *
                                 self->layout.height_px * sizeof(uint16_t);
    unsigned count = V4L2_STREAM_BUFFERS;
    while (count > V4L2_STREAM_BUFFERS_MIN &&
           count * buffer_bytes + FRAMES_BESIDE * frame_bytes + RAW_MEMORY_RESERVE_BYTES >
               free_bytes) {
        count--;
    }
    return count * buffer_bytes + RAW_MEMORY_RESERVE_BYTES <= free_bytes ? count : 1;
}

static int check_memory(struct v4l2_stream *self, unsigned *wanted) {
    const uint64_t free_bytes = memory_available_bytes();
    *wanted = count_buffers(self, free_bytes);
    return *wanted >= V4L2_STREAM_BUFFERS_MIN
               ? ERROR_OK
               : message_set(&self->last_error, ERROR_MEMORY,
                             "out of memory: the driver needs two buffers of %.1f MB, %.1f MB are "
                             "free (try smaller frames)",
                             self->buffer_bytes / bytes_per_mb, (double)free_bytes / bytes_per_mb);
}

/// Requests and maps the buffers and starts the stream. On an error what was created remains.
static int turn_on(struct v4l2_stream *self) {
    unsigned wanted = 0, given = 0;
    int error = check_memory(self, &wanted);
    error = error == ERROR_OK ? request_buffers(self, wanted, &given) : error;
    if (error != ERROR_OK) {
        return error;
    }
    // With one buffer the driver has no room for the next frame.
    if (given < V4L2_STREAM_BUFFERS_MIN) {
        return message_set(&self->last_error, ERROR_IO,
                           "the driver has memory for only %u frames (try smaller frames)", given);
    }
    given = given < V4L2_STREAM_BUFFERS_MAX ? given : V4L2_STREAM_BUFFERS_MAX;
    for (unsigned i = 0; error == ERROR_OK && i < given; i++) {
        error = map_buffer(self, i);
    }
    for (unsigned i = 0; error == ERROR_OK && i < given; i++) {
        error = v4l2_stream_queue(self, i);
    }
    if (error != ERROR_OK) {
        return error;
    }
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device_file_control(self->fd, VIDIOC_STREAMON, &type) < 0) {
        const bool no_room = errno == ENOSPC;
        error = fail(self, "STREAMON");
        return no_room ? message_set(&self->last_error, ERROR_FULL,
                                     "not enough USB bandwidth for its frames (use another port of "
                                     "the computer, or smaller frames)")
                       : error;
    }
    self->on = true;
    return ERROR_OK;
}

int v4l2_stream_on(struct v4l2_stream *self) {
    INVARIANT(self->fd >= 0 && self->format != NULL && !self->on && self->count == 0);
    const int error = turn_on(self);
    if (error != ERROR_OK) {
        const struct message last_error = self->last_error;
        (void)v4l2_stream_off(self);
        self->last_error = last_error;
    }
    return error;
}

int v4l2_stream_start(struct v4l2_stream *self, const struct hal_camera_format *format) {
    INVARIANT(self->fd >= 0 && !self->on);
    int error = message_set(&self->last_error, ERROR_UNSUPPORTED,
                            "no supported format at %u x %u (v4l2-ctl --list-formats-ext lists "
                            "all)",
                            format->width_px, format->height_px);
    struct hal_camera_format nearest = {0, 0};
    const struct v4l2_pixels *pixels = NULL;
    for (unsigned i = 0; (pixels = v4l2_pixels_format(i)) != NULL; i++) {
        if (set_format(self, pixels, format, &nearest)) {
            self->frame_us = frame_time_us(self);
            error = v4l2_stream_on(self);
            // A format with fewer bytes may still fit the bus bandwidth.
            if (error != ERROR_FULL) {
                return error;
            }
        } else if (errno != 0) {
            return errno == EBUSY ? message_set(&self->last_error, ERROR_IO,
                                                "in use by another program (end it first)")
                                  : fail(self, "S_FMT");
        }
    }
    if (error == ERROR_UNSUPPORTED && nearest.width_px != 0) {
        message_set(&self->last_error, error,
                    "no supported format at %u x %u, the nearest is %u x %u (v4l2-ctl "
                    "--list-formats-ext lists all)",
                    format->width_px, format->height_px, nearest.width_px, nearest.height_px);
    }
    return error == ERROR_FULL ? ERROR_IO : error;
}

int v4l2_stream_off(struct v4l2_stream *self) {
    INVARIANT(self->fd >= 0);
    int error = ERROR_OK;
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (self->on && device_file_control(self->fd, VIDIOC_STREAMOFF, &type) < 0) {
        error = fail(self, "STREAMOFF");
    }
    self->on = false;
    for (unsigned i = 0; i < self->count; i++) {
        end_use(self->buffers[i].mapping);
    }
    memset(self->buffers, 0, sizeof self->buffers);
    self->count = 0;
    unsigned given = 0;
    const int released = request_buffers(self, 0, &given);
    return error != ERROR_OK ? error : released;
}

/// Checks the driver's description of a buffer; false if it is impossible.
static bool accept(struct v4l2_stream *self, const struct v4l2_buffer *buffer,
                   struct v4l2_stream_filled *filled) {
    if (buffer->index >= self->count || !self->buffers[buffer->index].queued) {
        return false;
    }
    struct v4l2_stream_buffer *own = &self->buffers[buffer->index];
    own->queued = false;
    const bool possible = buffer->bytesused <= own->bytes;
    *filled = (struct v4l2_stream_filled){
        .index = buffer->index,
        .pixels = self->layout,
        .sequence = buffer->sequence,
        .damaged = (buffer->flags & V4L2_BUF_FLAG_ERROR) != 0 || !possible,
        .has_time =
            (buffer->flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC,
        .time_begins =
            (buffer->flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE,
        .time_us =
            (uint64_t)buffer->timestamp.tv_sec * 1000000 + (uint64_t)buffer->timestamp.tv_usec};
    filled->pixels.data = own->data;
    filled->pixels.bytes = possible ? buffer->bytesused : own->bytes;
    return true;
}

int v4l2_stream_next(struct v4l2_stream *self, uint64_t deadline_us,
                     struct v4l2_stream_filled *filled) {
    INVARIANT(self->on);
    short revents = 0;
    for (int empty = 0; empty <= EMPTY_ANSWERS_MAX; empty++) {
        struct v4l2_buffer buffer;
        clear_buffer(&buffer, 0);
        if (device_file_control(self->fd, VIDIOC_DQBUF, &buffer) == 0) {
            if (!accept(self, &buffer, filled)) {
                return message_set(&self->last_error, ERROR_IO,
                                   "the driver returned a buffer that was not queued");
            }
            filled->waited = empty > 0;
            return ERROR_OK;
        }
        if (errno != EAGAIN) {
            return fail(self, "DQBUF");
        }
        if ((revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
            return message_set(&self->last_error, ERROR_IO,
                               "the driver reports an error (POLLERR)");
        }
        const int error = device_file_wait(self->fd, POLLIN, deadline_us, &revents);
        if (error != ERROR_OK) {
            return error == ERROR_IO ? fail(self, "poll") : error;
        }
    }
    return message_set(&self->last_error, ERROR_IO, "the driver reports frames but delivers none");
}

uint16_t *v4l2_stream_lend(struct v4l2_stream *self, unsigned index, struct raw_image *image) {
    INVARIANT(self->lends && index < self->count && !self->buffers[index].queued);
    struct v4l2_stream_mapping *mapping = self->buffers[index].mapping;
    const unsigned users = atomic_fetch_add(&mapping->users, 1);
    INVARIANT(users == 1);
    image->data = mapping->data;
    image->stride = (ptrdiff_t)(self->layout.bytes_per_line / sizeof(uint16_t));
    image->release = end_use;
    image->owner = mapping;
    return mapping->data;
}

bool v4l2_stream_is_lent(const struct v4l2_stream *self, unsigned index) {
    INVARIANT(index < self->count);
    return atomic_load(&self->buffers[index].mapping->users) > 1;
}

int v4l2_stream_renew(struct v4l2_stream *self) {
    unsigned wanted = 0;
    int error = check_memory(self, &wanted);
    error = error == ERROR_OK ? v4l2_stream_off(self) : error;
    return error == ERROR_OK ? v4l2_stream_on(self) : error;
}

unsigned v4l2_stream_left(const struct v4l2_stream *self) {
    unsigned left = 0;
    for (unsigned i = 0; i < self->count; i++) {
        left += !v4l2_stream_is_lent(self, i);
    }
    return left;
}

unsigned v4l2_stream_missing(const struct v4l2_stream *self, unsigned frames) {
    const unsigned left = v4l2_stream_left(self);
    const unsigned missing = frames > left ? frames - left : 0;
    return (missing + V4L2_STREAM_BUFFERS_MIN - 1) / V4L2_STREAM_BUFFERS_MIN *
           V4L2_STREAM_BUFFERS_MIN;
}

// SPDX-License-Identifier: Apache-2.0
#include "fake_video.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "fake_file.h"
#include "fake_kernel.h"
#include "fake_picture.h"
#include "fake_video_names.h"

enum { VIDEOS = 4, PAGE_BYTES = 4096 };

static struct fake_video videos[VIDEOS];
static unsigned video_count;

static bool is_compressed(uint32_t fourcc) {
    return fourcc == V4L2_PIX_FMT_MJPEG;
}

static uint32_t bytes_per_pixel(uint32_t fourcc) {
    return fourcc == V4L2_PIX_FMT_YUYV || fourcc == V4L2_PIX_FMT_SGRBG10 ? 2 : 1;
}

static uint32_t frame_bytes(const struct fake_video_format *format) {
    return is_compressed(format->fourcc) ? format->width_px * format->height_px * 2
                                         : format->bytes_per_line * format->height_px;
}

/// The buffer's offset in the device's memory.
static size_t offset_of(const struct fake_video *self, unsigned index) {
    return self->memory_begin + index * self->buffer_bytes;
}

static struct fake_video_control *control_of(struct fake_video *self, uint32_t id) {
    for (int i = 0; i < FAKE_VIDEO_CONTROLS; i++) {
        if (id != 0 && self->controls[i].id == id) {
            return &self->controls[i];
        }
    }
    return NULL;
}

/// Makes a picture as bright as exposure and gain, of at most 8, ask for.
static void expose(struct fake_video *self, uint8_t *data, size_t bytes) {
    const struct fake_video_control *exposure = control_of(self, V4L2_CID_EXPOSURE_ABSOLUTE);
    const struct fake_video_control *gain = control_of(self, V4L2_CID_GAIN);
    const double factor = 1 + 7.0 * gain->value / gain->maximum;
    fake_picture_expose(self->format.fourcc, factor * exposure->value / self->bright_at, data,
                        bytes);
}

static void paint(struct fake_video *self, uint32_t sequence, uint8_t *data, size_t *bytes) {
    const struct fake_video_format *format = &self->format;
    if (self->picture != NULL) {
        fake_picture_paint(self->picture, format->fourcc, format->width_px, format->height_px,
                           sequence, data, bytes);
        if (self->bright_at != 0) {
            expose(self, data, *bytes);
        }
    } else if (self->paint != NULL) {
        self->paint(self, sequence, data, bytes);
    } else {
        for (size_t i = 0; i < *bytes; i++) {
            data[i] = (uint8_t)(i % format->bytes_per_line + i / format->bytes_per_line + sequence);
        }
    }
}

/// A complete frame.
struct frame {
    const uint8_t *data;
    size_t bytes;
    uint32_t sequence;
    uint64_t begin_us, end_us;
    bool damaged;
};

/// Puts a frame into the first waiting buffer, which must exist.
static void fill(struct fake_video *self, const struct frame *frame) {
    const unsigned index = self->queued[0];
    self->queued_count--;
    memmove(self->queued, self->queued + 1, self->queued_count * sizeof self->queued[0]);
    const ssize_t written =
        syscall(SYS_pwrite64, self->fd, frame->data, frame->bytes, (off_t)offset_of(self, index));
    if (written != (ssize_t)frame->bytes) {
        abort();
    }
    const bool begins =
        (self->time_flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    const uint64_t stamp_us = begins ? frame->begin_us : frame->end_us;
    struct v4l2_buffer *done = &self->done[self->done_count++];
    memset(done, 0, sizeof *done);
    done->index = index;
    done->type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    done->memory = V4L2_MEMORY_MMAP;
    done->bytesused = (uint32_t)frame->bytes;
    done->flags = self->time_flags | V4L2_BUF_FLAG_DONE;
    done->flags |= frame->damaged ? V4L2_BUF_FLAG_ERROR : 0;
    done->sequence = self->counts ? frame->sequence : 0;
    done->length = (uint32_t)self->buffer_bytes;
    done->timestamp.tv_sec = (time_t)(stamp_us / 1000000);
    done->timestamp.tv_usec = (suseconds_t)(stamp_us % 1000000);
}

static uint32_t readout_us(const struct fake_video *self) {
    return self->triggered && self->readout_us != 0 ? self->readout_us : self->frame_us;
}

/// Puts the frame that ends at `end_us` into the first waiting buffer, if any.
static void deliver(struct fake_video *self, uint64_t end_us) {
    const uint32_t sequence = self->sequence++;
    const bool lost = self->lose_every != 0 && (sequence + 1) % self->lose_every == 0;
    if (self->queued_count <= self->keeps_buffers || lost) {
        return;
    }
    size_t bytes = frame_bytes(&self->format);
    uint8_t *data = malloc(bytes);
    if (data == NULL) {
        abort();
    }
    paint(self, sequence, data, &bytes);
    const struct frame frame = {
        .data = data,
        .bytes = bytes,
        .sequence = sequence,
        .begin_us = end_us - readout_us(self),
        .end_us = end_us,
        .damaged = self->damage_every != 0 && (sequence + 1) % self->damage_every == 0};
    fill(self, &frame);
    free(data);
}

/// Simulates everything up to `now_us`.
static void catch_up(struct fake_video *self, uint64_t now_us) {
    while (self->on && self->next_us <= now_us) {
        if (self->frames_until_still != 0 && self->sequence >= self->frames_until_still) {
            self->next_us = UINT64_MAX;
            return;
        }
        deliver(self, self->next_us);
        self->next_us = self->triggered ? UINT64_MAX : self->next_us + self->frame_us;
    }
}

void fake_video_pulse(struct fake_video *self) {
    const uint64_t now_us = fake_kernel_now_us();
    catch_up(self, now_us);
    if (self->on && self->triggered && self->next_us == UINT64_MAX) {
        self->next_us = now_us + readout_us(self);
    }
}

static int query_capabilities(const struct fake_video *self, struct v4l2_capability *ability) {
    memset(ability, 0, sizeof *ability);
    snprintf((char *)ability->driver, sizeof ability->driver, "fake");
    snprintf((char *)ability->card, sizeof ability->card, "Fake camera");
    snprintf((char *)ability->bus_info, sizeof ability->bus_info, "usb-fake-%d",
             (int)(self - videos));
    ability->device_caps = self->capabilities;
    ability->capabilities = self->capabilities | V4L2_CAP_DEVICE_CAPS;
    return 0;
}

/// Changes unsupported values to supported ones, as drivers do.
static int set_format(struct fake_video *self, struct v4l2_format *request) {
    if (self->count > 0) {
        return -EBUSY;
    }
    struct v4l2_pix_format *pix = &request->fmt.pix;
    const struct fake_video_format *chosen = &self->formats[0];
    for (int i = 0; i < FAKE_VIDEO_FORMATS; i++) {
        const struct fake_video_format *one = &self->formats[i];
        if (one->fourcc == pix->pixelformat &&
            (chosen->fourcc != pix->pixelformat ||
             (one->width_px == pix->width && one->height_px == pix->height))) {
            chosen = one;
        }
    }
    self->format = *chosen;
    if (self->format.bytes_per_line == 0) {
        self->format.bytes_per_line = self->format.width_px * bytes_per_pixel(chosen->fourcc);
    }
    pix->pixelformat = chosen->fourcc;
    pix->width = self->format.width_px;
    pix->height = self->format.height_px;
    pix->field = V4L2_FIELD_NONE;
    pix->bytesperline = is_compressed(chosen->fourcc) ? 0 : self->format.bytes_per_line;
    pix->sizeimage = frame_bytes(&self->format);
    pix->quantization = self->full_range ? V4L2_QUANTIZATION_FULL_RANGE : V4L2_QUANTIZATION_DEFAULT;
    return 0;
}

static int get_parameters(const struct fake_video *self, struct v4l2_streamparm *parameters) {
    memset(&parameters->parm, 0, sizeof parameters->parm);
    parameters->parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
    parameters->parm.capture.timeperframe.numerator = self->frame_us;
    parameters->parm.capture.timeperframe.denominator = 1000000;
    return 0;
}

static int request_buffers(struct fake_video *self, struct v4l2_requestbuffers *request) {
    if (self->on) {
        return -EBUSY;
    }
    // Buffers that are still mapped keep their memory, and what was in it.
    self->memory_begin += self->keeps_orphans ? self->count * self->buffer_bytes : 0;
    const unsigned max = self->buffers_max;
    request->count = request->count < max ? request->count : max;
    request->capabilities = V4L2_BUF_CAP_SUPPORTS_MMAP |
                            (self->keeps_orphans ? V4L2_BUF_CAP_SUPPORTS_ORPHANED_BUFS : 0);
    self->count = request->count;
    self->queued_count = self->done_count = 0;
    self->buffer_bytes =
        (frame_bytes(&self->format) + PAGE_BYTES - 1) / PAGE_BYTES * (size_t)PAGE_BYTES;
    const size_t bytes = offset_of(self, self->count);
    return syscall(SYS_ftruncate, self->fd, (off_t)bytes) == 0 ? 0 : -errno;
}

static int query_buffer(const struct fake_video *self, struct v4l2_buffer *buffer) {
    if (buffer->index >= self->count) {
        return -EINVAL;
    }
    buffer->length = (uint32_t)self->buffer_bytes;
    buffer->m.offset = (uint32_t)offset_of(self, buffer->index);
    return 0;
}

static int queue_buffer(struct fake_video *self, const struct v4l2_buffer *buffer) {
    if (buffer->index >= self->count) {
        return -EINVAL;
    }
    for (unsigned i = 0; i < self->queued_count; i++) {
        if (self->queued[i] == buffer->index) {
            return -EINVAL;
        }
    }
    self->queued[self->queued_count++] = buffer->index;
    return 0;
}

static int dequeue_buffer(struct fake_video *self, struct v4l2_buffer *buffer) {
    if (!self->on) {
        return -EINVAL;
    }
    if (self->done_count == 0) {
        return -EAGAIN;
    }
    *buffer = self->done[0];
    self->done_count--;
    memmove(self->done, self->done + 1, self->done_count * sizeof self->done[0]);
    if (self->corrupt != NULL) {
        self->corrupt(self, buffer);
    }
    return 0;
}

static int stream(struct fake_video *self, bool on) {
    if (on && self->count == 0) {
        return -EINVAL;
    }
    if (on && !self->on) {
        self->starts++;
        self->sequence = 0;
        self->next_us = fake_kernel_now_us() + self->first_us;
        if (self->phase_us >= 0) {
            self->next_us += self->frame_us - self->next_us % self->frame_us;
            self->next_us += (uint32_t)self->phase_us;
        }
        self->next_us = self->triggered ? UINT64_MAX : self->next_us;
    }
    if (!on) {
        self->queued_count = self->done_count = 0;
    }
    self->on = on;
    return 0;
}

static int use_control(struct fake_video *self, unsigned long request, void *argument) {
    // The id is the first member of both structs.
    struct fake_video_control *own = control_of(self, *(const uint32_t *)argument);
    if (own == NULL) {
        return -EINVAL;
    }
    if (request == VIDIOC_QUERYCTRL) {
        struct v4l2_queryctrl *query = argument;
        memset(query, 0, sizeof *query);
        *query = (struct v4l2_queryctrl){.id = own->id,
                                         .type = V4L2_CTRL_TYPE_INTEGER,
                                         .minimum = own->minimum,
                                         .maximum = own->maximum,
                                         .step = own->step};
        return 0;
    }
    struct v4l2_control *control = argument;
    if (request == VIDIOC_S_CTRL) {
        if (control->value < own->minimum || control->value > own->maximum) {
            return -ERANGE;
        }
        own->value = control->value;
    }
    control->value = own->value;
    return 0;
}

static int carry_out(struct fake_video *self, unsigned long request, void *argument) {
    switch (request) {
        case VIDIOC_QUERYCAP:
            return query_capabilities(self, argument);
        case VIDIOC_S_FMT:
            return set_format(self, argument);
        case VIDIOC_G_PARM:
            return get_parameters(self, argument);
        case VIDIOC_REQBUFS:
            return request_buffers(self, argument);
        case VIDIOC_QUERYBUF:
            return query_buffer(self, argument);
        case VIDIOC_QBUF:
            return queue_buffer(self, argument);
        case VIDIOC_DQBUF:
            return dequeue_buffer(self, argument);
        case VIDIOC_STREAMON:
        case VIDIOC_STREAMOFF:
            return stream(self, request == VIDIOC_STREAMON);
        case VIDIOC_QUERYCTRL:
        case VIDIOC_S_CTRL:
        case VIDIOC_G_CTRL:
            return use_control(self, request, argument);
        default:
            return -ENOTTY;
    }
}

static int control(struct fake_file *file, unsigned long request, void *argument) {
    struct fake_video *self = file->state;
    catch_up(self, fake_kernel_now_us());
    return carry_out(self, request, argument);
}

static short poll_events(struct fake_file *file, uint64_t now_us, uint64_t *next_us) {
    struct fake_video *self = file->state;
    catch_up(self, now_us);
    if (self->on && self->done_count > 0) {
        return POLLIN | POLLRDNORM;
    }
    if (!self->on || self->queued_count == 0) {
        return POLLERR;
    }
    *next_us = self->next_us < *next_us ? self->next_us : *next_us;
    return 0;
}

static int open_camera(struct fake_file *file) {
    struct fake_video *self = file->state;
    self->fd = file->fd;
    return 0;
}

static void close_camera(struct fake_file *file) {
    struct fake_video *self = file->state;
    self->on = false;
    self->count = 0;
}

struct fake_video *fake_video_add(const char *path, uint32_t fourcc, uint32_t width_px,
                                  uint32_t height_px) {
    static const struct fake_operations operations = {.open = open_camera,
                                                      .close = close_camera,
                                                      .describe = fake_video_describe,
                                                      .ioctl = control,
                                                      .poll = poll_events};
    if (video_count == VIDEOS) {
        abort();
    }
    struct fake_video *self = &videos[video_count];
    *self = (struct fake_video){
        .capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING,
        .formats = {{fourcc, width_px, height_px, 0}},
        .buffers_max = FAKE_VIDEO_BUFFERS,
        .keeps_orphans = true,
        .frame_us = 33333,
        .first_us = 33333,
        .time_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF,
        .counts = true,
        .phase_us = -1,
        .fd = -1};
    fake_file_device(path, 81, video_count++, &operations, self);
    return self;
}

void fake_video_forget(void) {
    video_count = 0;
}

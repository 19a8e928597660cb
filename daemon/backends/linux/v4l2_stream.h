// SPDX-License-Identifier: Apache-2.0
/// A V4L2 capture device that streams into mapped memory: formats, buffers, on and off. v4l2_camera
/// handles interruptions.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_STREAM_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_STREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/backends/linux/v4l2_pixels.h"
#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Buffers requested: so many that three pairs have room beside them, at least the minimum and at
/// most V4L2_STREAM_BUFFERS. A driver may give a different number, up to the maximum.
enum { V4L2_STREAM_BUFFERS_MIN = 2, V4L2_STREAM_BUFFERS = 4, V4L2_STREAM_BUFFERS_MAX = 8 };

/// A mapping, which ends when neither the stream nor a lent frame uses it.
struct v4l2_stream_mapping;

struct v4l2_stream_buffer {
    const uint8_t *data;
    size_t bytes;
    struct v4l2_stream_mapping *mapping;
    uint64_t queued_us;  ///< time at which the buffer was last queued
    bool queued;
};

/// The caller owns it.
struct v4l2_stream {
    int fd;
    char driver[16], card[32], bus[32];  ///< names reported by the driver; valid while open
    const struct v4l2_pixels *format;
    struct v4l2_pixels_source layout;  ///< layout of all buffers; `data` and `bytes` are not set
    uint32_t buffer_bytes;             ///< size of one buffer, as reported with the format
    uint32_t frame_us;                 ///< frame interval reported by the driver; 0: not reported
    struct v4l2_stream_buffer buffers[V4L2_STREAM_BUFFERS_MAX];
    unsigned count;
    bool on;
    bool lends;                 ///< frames may stay in its buffers, see v4l2_stream_lend
    bool copies;                ///< frames are copied in any case; set by the caller
    struct message last_error;  ///< the last error, without the device's name
};

/// A buffer filled by the driver.
struct v4l2_stream_filled {
    unsigned index;
    struct v4l2_pixels_source pixels;
    uint32_t sequence;
    bool damaged;      ///< V4L2_BUF_FLAG_ERROR, or impossible numbers
    bool waited;       ///< no buffer was ready when it was requested
    bool has_time;     ///< `time_us` is of CLOCK_MONOTONIC
    bool time_begins;  ///< it is the start of exposure, not the end of the frame
    uint64_t time_us;
};

/// Opens a device and checks that it captures and streams. ERROR_DEVICE, ERROR_REFUSED,
/// ERROR_UNSUPPORTED, ERROR_IO, with a message, and nothing is open.
int v4l2_stream_open(struct v4l2_stream *self, const char *path, struct message *message);
void v4l2_stream_close(struct v4l2_stream *self);

/// Starts the first supported format that the camera offers in this size and the bus has bandwidth
/// for. ERROR_UNSUPPORTED, ERROR_DEVICE, ERROR_MEMORY, ERROR_IO, with details in the field of the
/// last error.
int v4l2_stream_start(struct v4l2_stream *self, const struct hal_camera_format *format);
/// Restarts the same format after `v4l2_stream_off`.
int v4l2_stream_on(struct v4l2_stream *self);
/// Stops and releases all buffers; continues after an error and returns the first.
int v4l2_stream_off(struct v4l2_stream *self);

/// Waits for the next filled buffer. ERROR_TIMEOUT; ERROR_DEVICE: it has disappeared; ERROR_IO: the
/// stream is broken and must be restarted.
int v4l2_stream_next(struct v4l2_stream *self, uint64_t deadline_us,
                     struct v4l2_stream_filled *filled);
/// Queues a buffer for the driver. ERROR_DEVICE; ERROR_IO.
int v4l2_stream_queue(struct v4l2_stream *self, unsigned index);

/// Makes a buffer that was filled the pixels of an image, and returns where they are. The buffer
/// may be queued again after raw_image_release. The pixels are there until then, even if the stream
/// is stopped or closed. Only if it lends.
uint16_t *v4l2_stream_lend(struct v4l2_stream *self, unsigned index, struct raw_image *image);
/// Whether an image has this buffer.
bool v4l2_stream_is_lent(const struct v4l2_stream *self, unsigned index);
/// Leaves all buffers to their images and continues with others. ERROR_MEMORY: there is no room for
/// them, and nothing has changed; else as v4l2_stream_on.
int v4l2_stream_renew(struct v4l2_stream *self);
/// Buffers that no image has.
unsigned v4l2_stream_left(const struct v4l2_stream *self);
/// Buffers for which the driver takes memory before it has lent so many more frames.
unsigned v4l2_stream_missing(const struct v4l2_stream *self, unsigned frames);

#ifdef __cplusplus
}
#endif

#endif

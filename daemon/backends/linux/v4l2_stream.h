// SPDX-License-Identifier: Apache-2.0
/// A capture device of V4L2 that streams by mapped memory: formats, buffers, on and off. What to do
/// when it stops is v4l2_camera's business.
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

/// Buffers that are asked for; a driver may give others, up to the second number.
enum { V4L2_STREAM_BUFFERS = 4, V4L2_STREAM_BUFFERS_MAX = 8 };

struct v4l2_stream_buffer {
    const uint8_t *data;  ///< mapped
    size_t bytes;
    uint64_t queued_us;  ///< when the driver got it last
    bool queued;
};

/// The caller owns it.
struct v4l2_stream {
    int fd;
    char driver[16], card[32], bus[32];  ///< as the driver calls them; while it is open
    const struct v4l2_pixels *format;
    struct v4l2_pixels_source layout;  ///< of every buffer; `data` and `bytes` are not set
    uint32_t frame_us;                 ///< from frame to frame as the driver says; 0: it does not
    struct v4l2_stream_buffer buffers[V4L2_STREAM_BUFFERS_MAX];
    unsigned count;
    bool on;
    struct message trouble;  ///< what the last error was, without the device's name
};

/// A buffer that the driver has filled.
struct v4l2_stream_filled {
    unsigned index;
    struct v4l2_pixels_source pixels;
    uint32_t sequence;
    bool damaged;      ///< V4L2_BUF_FLAG_ERROR, or impossible numbers
    bool waited;       ///< none was there when it was asked for
    bool has_time;     ///< `time_us` is of CLOCK_MONOTONIC
    bool time_begins;  ///< it is when the exposure began, not when the frame was whole
    uint64_t time_us;
};

/// Opens a device and sees to it that it captures and streams. ERROR_DEVICE, ERROR_REFUSED,
/// ERROR_UNSUPPORTED, ERROR_IO; `message` says more and nothing is open then.
int v4l2_stream_open(struct v4l2_stream *self, const char *path, struct message *message);
void v4l2_stream_close(struct v4l2_stream *self);

/// Chooses the first of our formats that the camera has in this size and for which the bus has
/// room, and lets it run. ERROR_UNSUPPORTED, ERROR_DEVICE, ERROR_IO; `trouble` says more.
int v4l2_stream_start(struct v4l2_stream *self, const struct hal_camera_format *format);
/// The same format again, after `v4l2_stream_off`.
int v4l2_stream_on(struct v4l2_stream *self);
/// Stops and gives all buffers back; goes on when something fails and returns the first error.
int v4l2_stream_off(struct v4l2_stream *self);

/// Waits for the next filled buffer. ERROR_TIMEOUT; ERROR_DEVICE: it is gone; ERROR_IO: the stream
/// is broken and has to be made anew.
int v4l2_stream_next(struct v4l2_stream *self, uint64_t deadline_us,
                     struct v4l2_stream_filled *filled);
/// Gives a buffer to the driver. ERROR_DEVICE; ERROR_IO.
int v4l2_stream_queue(struct v4l2_stream *self, unsigned index);

#ifdef __cplusplus
}
#endif

#endif

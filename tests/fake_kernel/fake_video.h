// SPDX-License-Identifier: Apache-2.0
/// A fake /dev/video*: a camera with a frame clock, a buffer queue and controls. As with a real
/// driver, a frame without a buffer is lost, with its number.
#ifndef VERGENCE_TESTS_FAKE_VIDEO_H
#define VERGENCE_TESTS_FAKE_VIDEO_H

#include <linux/videodev2.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FAKE_VIDEO_BUFFERS = 16, FAKE_VIDEO_FORMATS = 8, FAKE_VIDEO_CONTROLS = 12 };

struct fake_video_format {
    uint32_t fourcc, width_px, height_px;
    uint32_t bytes_per_line;  ///< 0: minimal
};

struct fake_video_control {
    uint32_t id;
    int32_t minimum, maximum, step, value;
};

/// A camera. The test may change the fields above the line at any time.
struct fake_video {
    uint32_t capabilities;  ///< V4L2_CAP_* of the device
    struct fake_video_format formats[FAKE_VIDEO_FORMATS];
    struct fake_video_control controls[FAKE_VIDEO_CONTROLS];
    unsigned buffers_max;         ///< maximum number of buffers
    unsigned keeps_buffers;       ///< it fills a buffer only if so many others are queued
    bool keeps_orphans;           ///< a mapped buffer outlives its release, as since Linux 5.0
    uint32_t frame_us;            ///< frame interval
    uint32_t first_us;            ///< time from STREAMON to the end of the first frame
    uint32_t time_flags;          ///< V4L2_BUF_FLAG_TIMESTAMP_* and _TSTAMP_SRC_*
    bool counts;                  ///< false: sequence stays 0, as in some drivers
    bool full_range;              ///< V4L2_QUANTIZATION_FULL_RANGE
    uint32_t damage_every;        ///< 0: none; n: every n-th frame has V4L2_BUF_FLAG_ERROR
    uint32_t lose_every;          ///< 0: none; n: every n-th frame is missing, with its number
    int32_t phase_us;             ///< -1: frames end at any time; else so long after whole frame
                                  ///< times of the clock: two cameras that run freely
    bool triggered;               ///< frames only after fake_video_pulse, one each
    uint32_t readout_us;          ///< time from a pulse to the end of its frame; 0: frame_us
    uint32_t frames_until_still;  ///< 0: unlimited; n: the stream stops after n frames
    /// Fills a frame; `*bytes` is the capacity, then the filled size. NULL: every byte is x + y +
    /// the frame's number.
    void (*paint)(struct fake_video *self, uint32_t sequence, uint8_t *data, size_t *bytes);
    /// May change what DQBUF returns. NULL: nothing.
    void (*corrupt)(struct fake_video *self, struct v4l2_buffer *buffer);
    const char *picture;  ///< an image file (fake_picture.h), read again when it changes; or NULL
    uint32_t bright_at;  ///< exposure, in 100 us, at which the picture is as bright as its file; 0:
                         ///< at any exposure
    void *user;
    // ---
    struct fake_video_format format;
    /// One buffer's size, and where the first one begins in the device's memory.
    size_t buffer_bytes, memory_begin;
    unsigned count, queued_count, done_count;
    unsigned queued[FAKE_VIDEO_BUFFERS];
    struct v4l2_buffer done[FAKE_VIDEO_BUFFERS];
    bool on;
    uint64_t next_us;   ///< end of the next frame
    uint32_t sequence;  ///< number of the next frame
    unsigned starts;    ///< STREAMONs so far
    int fd;
};

/// Adds a camera with one format, 30 frames/s, exact time stamps at the frame ends, and at most 16
/// buffers. Owned by the fake kernel until the next reset; at most 4 cameras.
struct fake_video *fake_video_add(const char *path, uint32_t fourcc, uint32_t width_px,
                                  uint32_t height_px);
/// Activates the trigger input. A camera that is not streaming, or busy with its last frame,
/// ignores it.
void fake_video_pulse(struct fake_video *self);
/// Removes all cameras.
void fake_video_forget(void);

#ifdef __cplusplus
}
#endif

#endif

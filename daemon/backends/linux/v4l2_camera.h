// SPDX-License-Identifier: Apache-2.0
/// hal_camera on a Linux video device: a webcam, or the parallel port behind the camera select.
///
/// A broken stream (driver error, no frame for three frame times, an impossible buffer) is stopped,
/// its buffers are released, and it is restarted: at most 3 times per call, at once and then after
/// increasing pauses within the call's deadline. Each restart is counted and logged.
///
/// Frames that need no conversion are lent: they stay in the driver's buffers, of which the driver
/// gets new ones when all are lent. If its frames cease meanwhile, as it may need more buffers than
/// that leaves, frames are copied from then on, until the camera is opened again.
///
/// An unplugged camera returns ERROR_DEVICE until `start` finds it at its path again.
///
/// Times of frames: a monotonic driver time stamp is exact at one end; the other end is one frame
/// time away (plus the exposure, as set, for a stamp of the start of exposure), so that a frame
/// never appears to begin later than it did. Drivers without such stamps give a bound: a frame that
/// was waited for is complete now, one that was already there was complete after its buffer had
/// been queued.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_CAMERA_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_CAMERA_H

#include "daemon/backends/linux/v4l2_stream.h"
#include "daemon/base/message.h"
#include "hal/camera.h"
#include "hal/log.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The caller owns it; `hal` points to it, so it must not move.
struct v4l2_camera {
    struct hal_camera hal;
    struct v4l2_stream stream;
    char path[64];
    const struct hal_log *log;  ///< NULL: none
    uint32_t frame_us;          ///< longest frame interval
    uint32_t exposure_us;       ///< last set or read; 0: unknown
    /// Frames come only when triggered, so a missing frame does not mean a broken stream. Set by
    /// the caller after v4l2_camera_init.
    bool triggered;
    bool gone;  ///< it was unplugged: the next start reopens it
    bool started;
    /// Why it does not start, without the device's name; "": it did, or it does not support this
    /// format.
    struct message refused;
    struct hal_camera_format format;
    struct hal_camera_counts counts;

    bool has_sequence;
    uint32_t driver_sequence, sequence;  ///< numbers of the last frame: the driver's, this object's
    /// When the last frame came or the stream was started, plus the time since then without a
    /// caller that waits: some drivers make frames for one only.
    uint64_t alive_us;
    uint64_t returned_us;  ///< time at which the last caller stopped waiting
    uint32_t timeout_us;   ///< time limit for the next frame
};

/// Initialises a closed camera: it returns ERROR_DEVICE until `start` finds it at its path.
void v4l2_camera_init(struct v4l2_camera *self, const char *path, uint32_t frame_us,
                      const struct hal_log *log);
/// Opens a camera, for example "/dev/video0", without starting it. `frame_us`: the longest frame
/// interval, used if the driver does not report one. ERROR_DEVICE, ERROR_REFUSED,
/// ERROR_UNSUPPORTED, ERROR_IO, with a message, and nothing is open.
int v4l2_camera_open(struct v4l2_camera *self, const char *path, uint32_t frame_us,
                     const struct hal_log *log, struct message *message);
/// Ensures that the camera now at its path is open; an unplugged or different one is stopped.
/// Errors as for v4l2_camera_open.
int v4l2_camera_renew(struct v4l2_camera *self, struct message *message);
/// Stops and releases all memory.
void v4l2_camera_close(struct v4l2_camera *self);

#ifdef __cplusplus
}
#endif

#endif

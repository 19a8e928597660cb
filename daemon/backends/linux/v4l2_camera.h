// SPDX-License-Identifier: Apache-2.0
/// hal_camera on a Linux video device: a webcam, or the parallel port behind the camera select.
///
/// A stream that breaks (an error of the driver, no frame for three times what one takes, a buffer
/// that cannot be) is stopped, its buffers are released, and it is started again: at most 3 times a
/// call, with growing pauses, within the call's deadline. Each is counted and told to the log.
///
/// A camera that was pulled out says ERROR_DEVICE until `start` finds it under its path again.
///
/// Times of frames: with a monotonic time stamp from the driver they are exact at one end, and the
/// other end is one frame time away (and the exposure, as it was set, behind a stamp of when that
/// began), so that a frame never seems to have begun later than it did.
/// Drivers without such stamps give a bound: a frame that was waited for became whole just now, one
/// that was there already became so after its buffer had been queued.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_CAMERA_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_CAMERA_H

#include "daemon/backends/linux/v4l2_stream.h"
#include "daemon/base/message.h"
#include "hal/camera.h"
#include "hal/log.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Frames that can be lent at a time.
enum { V4L2_CAMERA_LENT_MAX = 2 };

/// The caller owns it; `hal` points to it, so it must not move.
struct v4l2_camera {
    struct hal_camera hal;
    struct v4l2_stream stream;
    char path[64];
    const struct hal_log *log;  ///< NULL: none
    uint32_t frame_us;          ///< longest time from frame to frame
    uint32_t exposure_us;       ///< as it was set or found last; 0: it is not known
    /// Frames come when somebody lets them: that none comes does not mean that the stream broke.
    /// The caller's to set, after v4l2_camera_init.
    bool triggered;
    bool gone;  ///< it was pulled out: the next start opens it again
    bool started;
    /// Why it does not start, without the device's name; "": it did, or it has no such frames.
    struct message refused;
    struct hal_camera_format format;
    struct hal_camera_counts counts;

    uint16_t *slots[V4L2_CAMERA_LENT_MAX];  ///< memory of the frames that are lent
    bool lent[V4L2_CAMERA_LENT_MAX];
    size_t slot_values;

    bool has_sequence;
    uint32_t driver_sequence, sequence;  ///< of the last frame: the driver's, ours
    uint64_t alive_us;                   ///< a frame came, or the stream was started
    uint32_t patience_us;                ///< how long the next one may take
};

/// Makes it one that is not open, and says ERROR_DEVICE until `start` finds it under its path.
void v4l2_camera_init(struct v4l2_camera *self, const char *path, uint32_t frame_us,
                      const struct hal_log *log);
/// Opens a camera, for example "/dev/video0", without starting it. `frame_us`: the longest time
/// from frame to frame, where the driver does not tell. ERROR_DEVICE, ERROR_REFUSED,
/// ERROR_UNSUPPORTED, ERROR_IO; `message` says more; nothing is open then.
int v4l2_camera_open(struct v4l2_camera *self, const char *path, uint32_t frame_us,
                     const struct hal_log *log, struct message *message);
/// Sees to it that the camera that is under its path now is open; one that was pulled out, or
/// another one, is stopped. No frame may be lent. Errors as of v4l2_camera_open.
int v4l2_camera_renew(struct v4l2_camera *self, struct message *message);
/// Stops, releases all memory.
void v4l2_camera_close(struct v4l2_camera *self);

#ifdef __cplusplus
}
#endif

#endif

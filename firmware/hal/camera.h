// SPDX-License-Identifier: Apache-2.0
/// A source of frames: the parallel port behind the camera select, or a camera with its own port.
///
/// Backends return 0 or these of core/error.h (V4L2 sources in parentheses):
///
/// - ERROR_TIMEOUT: no frame that began late enough was complete by the deadline (poll)
/// - ERROR_DEVICE: the camera is gone, or was never there (ENODEV, ENXIO)
/// - ERROR_UNSUPPORTED: the format or control is not supported (EINVAL of S_FMT)
/// - ERROR_RANGE: the value is outside the range of the control (ERANGE)
/// - ERROR_MEMORY: out of memory for a frame
/// - ERROR_IO: any other error of the system (EIO)
///
/// A backend whose stream stops restarts it within the deadline of a call, and counts that. A frame
/// that is known to be damaged is always marked in `faults`.
#ifndef VERGENCE_HAL_CAMERA_H
#define VERGENCE_HAL_CAMERA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/raw_image.h"

/// Faults of a frame, as bits.
enum {
    HAL_CAMERA_SHORT_LINE = 1,  ///< a line ended early or late
    HAL_CAMERA_SHORT = 2,       ///< rows are missing
    HAL_CAMERA_LONG = 4,        ///< there were extra rows
    HAL_CAMERA_DAMAGED = 8,     ///< reported by the driver (V4L2_BUF_FLAG_ERROR), or it could not
                                ///< be decoded
};

struct hal_camera_format {
    uint16_t width_px, height_px;
};

/// A frame. Times are on the system's hal_clock.
struct hal_camera_frame {
    struct raw_image image;
    uint32_t sequence;  ///< number that the source gave the frame; a gap means lost frames
    uint32_t faults;
    uint64_t begin_us, end_us;  ///< arrival of its first and last pixel
};

/// Statistics since the source was created; all wrap.
struct hal_camera_counts {
    uint32_t frames;    ///< frames delivered
    uint32_t faulty;    ///< delivered frames with faults
    uint32_t gaps;      ///< frames missing in the sequence numbers
    uint32_t timeouts;  ///< calls that timed out
    uint32_t restarts;  ///< restarts of a stream that had stopped
};

enum hal_camera_control {
    HAL_CAMERA_EXPOSURE_US,  ///< turns automatic exposure off; applied 0: not known
    HAL_CAMERA_GAIN_PART,    ///< 0 .. 1000 of the camera's range; turns automatic gain off
    HAL_CAMERA_FOCUS_PART,   ///< 0 .. 1000 of the camera's range; turns automatic focus off
    /// Changes nothing, whatever the value: `applied` is the exposure in force, which another
    /// program may have set; 0: automatic, or not known.
    HAL_CAMERA_EXPOSURE_FOUND_US,
    /// The same for gain and focus; ERROR_UNSUPPORTED: automatic, too.
    HAL_CAMERA_GAIN_FOUND_PART,
    HAL_CAMERA_FOCUS_FOUND_PART,
    /// Changes nothing: `applied` is the number of steps of the camera's focus range; 0: no focus
    /// control.
    HAL_CAMERA_FOCUS_STEPS,
    /// Switches everything off that the camera sets automatically, whatever the value. `applied`:
    /// bits HAL_CAMERA_AUTO_* of what was on, plus those, shifted by HAL_CAMERA_AUTO_STILL, of what
    /// cannot be switched off.
    HAL_CAMERA_AUTOMATIC_OFF,
};

enum {
    HAL_CAMERA_AUTO_EXPOSURE = 1,
    HAL_CAMERA_AUTO_GAIN = 2,
    HAL_CAMERA_AUTO_FOCUS = 4,
    HAL_CAMERA_AUTO_WHITE_BALANCE = 8,
    HAL_CAMERA_AUTO_STILL = 4,
};

/// What a backend implements; `self` is that of `struct hal_camera`.
struct hal_camera_operations {
    /// Starts frames of this size. The backend may have to reconfigure the camera.
    int (*start)(void *self, const struct hal_camera_format *format);
    int (*stop)(void *self);
    /// Waits for a frame whose first pixel arrived at `not_before_us` or later. The caller releases
    /// its image, which does not depend on the source, when it likes. ERROR_MEMORY: no room for it.
    int (*take)(void *self, uint64_t not_before_us, uint64_t deadline_us,
                struct hal_camera_frame *frame);
    /// NULL if the camera's registers are set in another way. `*applied` is the value accepted by
    /// the camera, which may differ a little from the request; with ERROR_RANGE the nearest
    /// accepted value, or unchanged.
    int (*control)(void *self, enum hal_camera_control control, int32_t value, int32_t *applied);
    void (*counts)(void *self, struct hal_camera_counts *counts);
};

/// A source. The backend owns what `self` points to, which must outlive all users.
struct hal_camera {
    const struct hal_camera_operations *operations;
    void *self;
};

#endif

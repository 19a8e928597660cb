// SPDX-License-Identifier: Apache-2.0
/// A source of frames: the parallel port behind the camera select, or a camera of its own.
///
/// Backends return 0 or these of core/error.h (in parentheses: where V4L2 has it from):
///
/// - ERROR_TIMEOUT: no frame that began late enough was whole by the deadline (poll)
/// - ERROR_DEVICE: the camera is gone or never was there (ENODEV, ENXIO)
/// - ERROR_UNSUPPORTED: it cannot give such frames, or has no such control (EINVAL of S_FMT)
/// - ERROR_RANGE: the control's value is outside what the camera takes (ERANGE)
/// - ERROR_IO: anything else that the system said (EIO)
///
/// A backend that loses the stream starts it again by itself within a call's deadline, and counts
/// it; it never hands out a frame that it knows to be torn without saying so in `faults`.
#ifndef VERGENCE_HAL_CAMERA_H
#define VERGENCE_HAL_CAMERA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum hal_camera_layout {
    HAL_CAMERA_GREY,        ///< one value a pixel
    HAL_CAMERA_RGB,         ///< three values a pixel, interleaved
    HAL_CAMERA_BAYER_GRBG,  ///< one value a pixel, linear; even rows G R, odd rows B G
};

/// What is wrong with a frame, as bits.
enum {
    HAL_CAMERA_SHORT_LINE = 1,  ///< a line ended early or late
    HAL_CAMERA_SHORT = 2,       ///< rows are missing
    HAL_CAMERA_LONG = 4,        ///< there were more rows
    HAL_CAMERA_DAMAGED = 8,     ///< the driver says so (V4L2_BUF_FLAG_ERROR), or it did not decode
};

struct hal_camera_format {
    uint16_t width_px, height_px;
};

/// A frame that the backend lends. Times are of the system's hal_clock.
struct hal_camera_frame {
    const uint16_t *data;
    uint16_t width_px, height_px;
    uint32_t stride;  ///< values from one row to the next
    uint8_t bits;     ///< 8 .. 16: values are 0 .. 2^bits - 1
    enum hal_camera_layout layout;
    uint32_t sequence;  ///< of the source; a gap means frames that nobody got
    uint32_t faults;
    uint64_t begin_us, end_us;  ///< its first and last pixel came
    void *token;                ///< the backend's
};

/// What happened since the source was made; all wrap.
struct hal_camera_counts {
    uint32_t frames;    ///< handed out
    uint32_t faulty;    ///< of these, with faults
    uint32_t gaps;      ///< frames that the sequence numbers miss
    uint32_t timeouts;  ///< calls that ended in one
    uint32_t restarts;  ///< of the stream, after it had stopped by itself
};

enum hal_camera_control {
    HAL_CAMERA_EXPOSURE_US,  ///< turns automatic exposure off; applied 0: it is not known
    HAL_CAMERA_GAIN_PART,    ///< 0 .. 1000 of the camera's range; turns automatic gain off
    HAL_CAMERA_FOCUS_PART,   ///< 0 .. 1000 of the camera's range; turns automatic focus off
    /// Changes nothing, whatever the value: applied is the exposure in force, which another program
    /// may have set; 0: the camera chooses it by itself, or it is not known.
    HAL_CAMERA_EXPOSURE_FOUND_US,
};

/// What a backend implements; `self` is that of `struct hal_camera`.
struct hal_camera_operations {
    /// Frames of this size from now on. The backend may have to change the camera for it.
    int (*start)(void *self, const struct hal_camera_format *format);
    /// No frames any more; frames that are lent must have been given back.
    int (*stop)(void *self);
    /// Waits for a frame whose first pixel came at `not_before_us` or later, and lends it. At most
    /// two frames are lent at a time.
    int (*take)(void *self, uint64_t not_before_us, uint64_t deadline_us,
                struct hal_camera_frame *frame);
    void (*give_back)(void *self, const struct hal_camera_frame *frame);
    /// NULL where the camera's registers are set in another way. `*applied` is the value that the
    /// camera took, which may be near the one asked for; with ERROR_RANGE the nearest that it
    /// takes, or untouched.
    int (*control)(void *self, enum hal_camera_control control, int32_t value, int32_t *applied);
    void (*counts)(void *self, struct hal_camera_counts *counts);
};

/// A source. The backend owns what `self` points to, which must outlive all users.
struct hal_camera {
    const struct hal_camera_operations *operations;
    void *self;
};

#endif

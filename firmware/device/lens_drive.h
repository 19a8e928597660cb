// SPDX-License-Identifier: Apache-2.0
/// A motorized lens, whatever controller it hangs on. Controllers differ in what they can do, so
/// each says it; who moves lenses (rig/lens_move.h) looks at that and not at the controller's name.
///
/// Positions are the controller's own counts. Errors: ERROR_NOT_CONNECTED: the lens has no such
/// axis; ERROR_RANGE: outside `lens_limits` (nothing was sent); ERROR_TIMEOUT: no answer that made
/// sense by the deadline; others of hal/uart.h.
#ifndef VERGENCE_DEVICE_LENS_DRIVE_H
#define VERGENCE_DEVICE_LENS_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

enum lens_axis { LENS_ZOOM, LENS_FOCUS, LENS_IRIS, LENS_AXES };

/// What a controller can do.
struct lens_abilities {
    bool reads_position;  ///< by a sensor; else the position is what was commanded
    bool tells_moving;    ///< says itself whether a motor runs
    bool stops;           ///< takes a command to stop, also while it moves
    bool answers_after;   ///< answers a move when it is done; else at once or never
    uint8_t axes;         ///< bit LENS_ZOOM, ...
};

/// The range that commands may have.
struct lens_limits {
    int32_t least, most;
};

/// Where an axis is.
struct lens_reading {
    int32_t position;
    bool moving;       ///< false when the controller does not tell
    uint64_t time_us;  ///< when it was read, of the system's hal_clock
};

/// What a driver implements; `self` is that of `struct lens_drive`. No call waits for a motor.
struct lens_drive_operations {
    /// Finds the controller and says what it can do. After ERROR_TIMEOUT the next call goes on with
    /// the same question: an answer may come later than a call may take.
    int (*open)(void *self, uint64_t deadline_us, struct lens_abilities *abilities);
    int (*limits)(void *self, enum lens_axis axis, struct lens_limits *limits);
    /// Starts a move.
    int (*go)(void *self, enum lens_axis axis, int32_t position, uint64_t deadline_us);
    /// ERROR_UNSUPPORTED where the controller cannot.
    int (*stop)(void *self, uint64_t deadline_us);
    /// Reads all axes at once, LENS_AXES of them; those that it lacks read 0.
    int (*read)(void *self, uint64_t deadline_us, struct lens_reading *readings);
    /// When the controller sent anything last, whether or not it made sense; 0: never.
    uint64_t (*heard)(const void *self);
};

/// A lens with motors. The driver owns what `self` points to, which must outlive all users.
struct lens_drive {
    const struct lens_drive_operations *operations;
    void *self;
};

#endif

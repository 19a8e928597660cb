// SPDX-License-Identifier: Apache-2.0
/// A motorized lens, independent of its controller. Controllers differ in their abilities, so each
/// reports them; code that moves lenses (rig/lens_move.h) depends on the abilities and not on the
/// controller's name.
///
/// Positions are the controller's own counts. Errors: ERROR_NOT_CONNECTED: the lens has no such
/// axis; ERROR_RANGE: outside `lens_limits` (nothing was sent); ERROR_TIMEOUT: no valid answer by
/// the deadline; others of hal/uart.h.
#ifndef VERGENCE_DEVICE_LENS_DRIVE_H
#define VERGENCE_DEVICE_LENS_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

enum lens_axis { LENS_ZOOM, LENS_FOCUS, LENS_IRIS, LENS_AXES };

/// Abilities of a controller.
struct lens_abilities {
    bool reads_position;  ///< position measured by a sensor; else the commanded position
    bool reports_moving;  ///< reports whether a motor is running
    bool stops;           ///< accepts a stop command, also during a move
    bool answers_after;   ///< answers a move when it is done; else at once or never
    uint8_t axes;         ///< bit LENS_ZOOM, ...
};

/// Range of positions in commands.
struct lens_limits {
    int32_t min, max;
};

/// A reading of an axis.
struct lens_reading {
    int32_t position;
    bool moving;       ///< false if the controller does not report it
    uint64_t time_us;  ///< when it was read, on the system's hal_clock
};

/// What a driver implements; `self` is that of `struct lens_drive`. No call waits for a motor.
struct lens_drive_operations {
    /// Finds the controller and returns its abilities. After ERROR_TIMEOUT the next call continues
    /// with the same question, as an answer may take longer than a call.
    int (*open)(void *self, uint64_t deadline_us, struct lens_abilities *abilities);
    int (*limits)(void *self, enum lens_axis axis, struct lens_limits *limits);
    /// Starts a move.
    int (*go)(void *self, enum lens_axis axis, int32_t position, uint64_t deadline_us);
    /// ERROR_UNSUPPORTED if the controller cannot stop.
    int (*stop)(void *self, uint64_t deadline_us);
    /// Reads all LENS_AXES axes at once; missing axes read 0.
    int (*read)(void *self, uint64_t deadline_us, struct lens_reading *readings);
    /// Time when the controller last sent anything, valid or not; 0: never.
    uint64_t (*last_rx)(const void *self);
};

/// A lens with motors. The driver owns what `self` points to, which must outlive all users.
struct lens_drive {
    const struct lens_drive_operations *operations;
    void *self;
};

#endif

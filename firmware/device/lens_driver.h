// SPDX-License-Identifier: Apache-2.0
/// Motorized lenses, independent of their controller. The table of lens_driver.c has one row for
/// each kind of controller: what connects it, what it can do, and how its motors move. Code that
/// moves lenses (rig/lens_move.h) depends on these abilities and settings, not on the name.
///
/// A new controller is a file device/lens_NAME.c with its `struct lens_operations`, and a row.
///
/// Positions are the controller's own counts. Errors: ERROR_NOT_CONNECTED: the lens has no such
/// axis; ERROR_RANGE: outside its settings (nothing was sent); ERROR_TIMEOUT: no valid answer by
/// the deadline; others of hal/uart.h or hal/i2c.h.
#ifndef VERGENCE_DEVICE_LENS_DRIVER_H
#define VERGENCE_DEVICE_LENS_DRIVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/clock.h"
#include "hal/i2c.h"
#include "hal/uart.h"

#ifdef __cplusplus
extern "C" {
#endif

enum lens_axis { LENS_ZOOM, LENS_FOCUS, LENS_IRIS, LENS_AXES };

/// "zoom", "focus", "iris".
extern const char *const lens_axis_names[LENS_AXES];

enum {
    LENS_LENSES_MAX = 2,     ///< largest number of lenses on one controller
    LENS_STATE_BYTES = 256,  ///< size that holds the state of any driver
};

/// What connects a controller.
enum lens_port { LENS_PORT_UART, LENS_PORT_I2C };

/// Abilities of a controller.
struct lens_abilities {
    bool reads_position;  ///< position measured by a sensor; else the commanded position
    bool reports_moving;  ///< reports whether a motor is running
    bool stops;           ///< accepts a stop command, also during a move
    uint8_t axes;         ///< bit LENS_ZOOM, ...
};

/// From which side a move reaches its target: always the same, because of backlash.
enum lens_approach { LENS_FROM_BELOW, LENS_FROM_ABOVE };

/// How an axis moves.
struct lens_axis_settings {
    int32_t min, max;          ///< range of positions in commands
    int32_t counts_per_s;      ///< a slower motor counts as jammed
    int32_t backlash_counts;   ///< a move overshoots by this, away from the side of approach
    int32_t tolerance_counts;  ///< a move is complete within this
    uint8_t approach;          ///< enum lens_approach
};

/// Range of positions in commands.
struct lens_limits {
    int32_t min, max;
};

/// What may differ between two instruments with the same controller.
struct lens_settings {
    uint32_t bits_per_s;  ///< UART only
    uint8_t address;      ///< I2C only
    struct lens_axis_settings axis[LENS_AXES];
    int32_t repeatability_counts;  ///< tolerance of a position that is approached again
    int32_t zoom_ppm;  ///< relative change of the focal length by one count of zoom, 1e-6
};

/// A reading of an axis.
struct lens_reading {
    int32_t position;
    bool moving;       ///< false if the controller does not report it
    uint64_t time_us;  ///< time of the request, on the system's hal_clock
    /// When the controller sampled the position, as far as the driver knows; 0: not known, as when
    /// an answer may be to one of several questions.
    uint64_t sampled_us;
};

/// The interfaces that drivers use; that of the driver's `port` and `clock` are required.
struct lens_ports {
    const struct hal_clock *clock;
    const struct hal_uart *uart;
    const struct hal_i2c *i2c;
};

struct lens_controller;

/// What a driver implements. No call waits for a motor. `lens`: 0 .. `lenses` - 1.
struct lens_operations {
    /// Finds the controller. After ERROR_TIMEOUT the next call continues with the same question, as
    /// an answer may take longer than a call.
    int (*open)(struct lens_controller *self, unsigned lens, uint64_t deadline_us);
    /// Starts a move of an axis that the lens has to a position within its range.
    int (*go)(struct lens_controller *self, unsigned lens, enum lens_axis axis, int32_t position,
              uint64_t deadline_us);
    /// Stops all motors of a lens; NULL if the controller cannot.
    int (*stop)(struct lens_controller *self, unsigned lens, uint64_t deadline_us);
    /// Reads all LENS_AXES axes at once; missing axes read 0. A deadline in the past: takes only
    /// what has already arrived. ERROR_TIMEOUT: the next call continues with the same question.
    int (*read)(struct lens_controller *self, unsigned lens, uint64_t deadline_us,
                struct lens_reading *readings);
    /// Time when the controller last sent anything, valid or not; 0: never.
    uint64_t (*last_rx)(const struct lens_controller *self);
};

/// A kind of lens controller.
struct lens_driver {
    const char *name;  ///< name in profiles
    const char *help;
    uint8_t lenses;  ///< number of lenses that it drives: the left one, or both
    enum lens_port port;
    struct lens_abilities abilities;
    int32_t position_max;  ///< largest position that its commands can express
    uint32_t sample_us;    ///< time from the end of a question to the sample that it reports
    struct lens_settings settings;  ///< defaults, which the profile may override
    const struct lens_operations *operations;
};

/// All drivers; `*count` of them. Static storage.
const struct lens_driver *lens_drivers(size_t *count);

/// The driver of this name; NULL: none.
const struct lens_driver *lens_driver_named(const char *name);

/// A controller. The caller owns it, and what it points to, which must outlive it.
struct lens_controller {
    const struct lens_driver *driver;
    const struct lens_settings *settings;
    struct lens_ports ports;
    union {
        unsigned char bytes[LENS_STATE_BYTES];
        uint64_t alignment;
    } state;  ///< the driver's; all 0 at the start
};

/// One of the lenses of a controller. `controller` NULL: no motors, or not open.
struct lens_drive {
    struct lens_controller *controller;
    unsigned number;
};

/// Stores the pointers. Sends nothing.
void lens_controller_init(struct lens_controller *self, const struct lens_driver *driver,
                          const struct lens_settings *settings, const struct lens_ports *ports);

bool lens_has_axis(const struct lens_drive *lens, enum lens_axis axis);

/// The driver's operations, with arguments checked. lens_stop: ERROR_UNSUPPORTED if the controller
/// cannot.
int lens_open(const struct lens_drive *lens, uint64_t deadline_us);
int lens_go(const struct lens_drive *lens, enum lens_axis axis, int32_t position,
            uint64_t deadline_us);
int lens_stop(const struct lens_drive *lens, uint64_t deadline_us);
int lens_read(const struct lens_drive *lens, uint64_t deadline_us,
              struct lens_reading readings[LENS_AXES]);
uint64_t lens_last_rx(const struct lens_drive *lens);

#ifdef __cplusplus
}
#endif

#endif

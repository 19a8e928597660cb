// SPDX-License-Identifier: Apache-2.0
/// The state of the instrument: its parts, what it is connected to, and what it is set to. The
/// functions are in rig/rig.h.
#ifndef VERGENCE_RIG_BASE_RIG_STATE_H
#define VERGENCE_RIG_BASE_RIG_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "device/fpga_bridge.h"
#include "device/fpga_bridge_camera.h"
#include "device/fpga_bridge_event.h"
#include "device/fpga_bridge_sensor.h"
#include "device/fpga_bridge_servo.h"
#include "device/lens_driver.h"
#include "device/mt9t001.h"
#include "focus/focus_search.h"
#include "focus/lens_learned.h"
#include "hal/camera.h"
#include "hal/clock.h"
#include "hal/gpio.h"
#include "hal/i2c.h"
#include "hal/log.h"
#include "hal/uart.h"
#include "rig/base/profile.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The parts, for messages, health and faults.
// X(name, text)
#define RIG_PART_LIST(X)                   \
    X(NONE, "none")                        \
    X(BRIDGE, "FPGA bridge")               \
    X(LEFT_SENSOR, "left sensor")          \
    X(RIGHT_SENSOR, "right sensor")        \
    X(LEFT_CAMERA, "left camera")          \
    X(RIGHT_CAMERA, "right camera")        \
    X(LEFT_SERVO, "left servo")            \
    X(RIGHT_SERVO, "right servo")          \
    X(LEFT_LENS, "left lens")              \
    X(RIGHT_LENS, "right lens")            \
    X(RESET_LINE, "bridge's reset line")   \
    X(IRQ_LINE, "bridge's interrupt line") \
    X(TRIGGER_LINE, "trigger line")

enum rig_part {
#define RIG_PART_ENUM(name, text) RIG_PART_##name,
    RIG_PART_LIST(RIG_PART_ENUM)
#undef RIG_PART_ENUM
        RIG_PARTS
};

/// Name of a part; static storage. `part` must be valid.
const char *rig_part_text(enum rig_part part);

struct rig_observer;

/// Opens the devices behind the ports. Devices come and go; the calls of a port whose device is
/// missing fail with ERROR_DEVICE.
struct rig_devices {
    /// Opens devices that are not open, and reopens those that have gone. Called at the start of
    /// each bring-up. Calls the observer while it waits for one.
    void (*open)(void *self, const struct rig_observer *observer);
    /// Why the device behind this part could not be opened or does not start, as text: which
    /// device, and what to do. NULL: it is open. The text is valid until the next call.
    const char *(*missing)(void *self, enum rig_part part);
    /// Identifies the camera behind this part among similar ones, for example by serial number or
    /// port; NULL: not known, or not open. The pointer itself may be NULL. The text is valid until
    /// the next call.
    const char *(*identity)(void *self, enum rig_part part);
    void *self;
};

/// The interfaces that the rig uses. `clock` is required; others may be NULL if the profile does
/// not need them. Behind a bridge both cameras are the same port.
struct rig_ports {
    const struct hal_clock *clock;
    const struct hal_i2c *i2c;
    const struct hal_gpio *gpio;
    const struct hal_camera *camera[RIG_SIDES];
    const struct hal_uart *lens_uart;
    const struct hal_log *log;
    const struct rig_devices *devices;  ///< NULL: devices stay open
};

/// Callbacks during a long call. Any pointer may be NULL.
struct rig_observer {
    /// True: end the call with ERROR_CANCELLED as soon as the rig is safe.
    bool (*should_stop)(void *self);
    /// Progress: `done` of `total` units; `what` is static storage.
    void (*progress)(void *self, const char *what, uint32_t done, uint32_t total);
    void *self;
};

enum { RIG_EXPOSURE_MAX_US = 10000000 };

/// A part of a camera's frame.
struct rig_rectangle {
    uint16_t column_px, row_px;  ///< top left corner
    uint16_t width_px, height_px;
};

/// An error of a part.
struct rig_error {
    enum rig_part part;
    int error;       ///< 0: no error
    char text[160];  ///< one line: part, what is wrong, and what to do
};

enum rig_state {
    RIG_DOWN,  ///< not brought up
    RIG_READY,
    RIG_SAFE,  ///< at rest after a failure: `bringup` again
};

/// State of a part when it was last used.
struct rig_part_health {
    bool present;
    int error;  ///< error of the last use; 0: it worked
    uint32_t uses, failures;
    uint64_t last_us;  ///< time of the last successful use
};

enum {
    RIG_LENS_TRACK = 32,
    /// Readings of a position at rest: their mean has a standard error of half a count, and a lens
    /// takes 0.23 s.
    RIG_LENS_READINGS = 4,
    RIG_LENS_READINGS_MAX = 32,
};

/// Mean of readings of an axis.
struct lens_mean {
    int32_t position_q4;  ///< 1/16 count; INT32_MIN: not known, or no such axis
    uint16_t sigma_q4;    ///< its standard error; 0: not known
};

/// A reading of all axes of a lens.
struct rig_lens_track {
    uint64_t sampled_us;
    int32_t position[LENS_AXES];
};

/// The lens of a camera. Positions are counts of the controller; INT32_MIN: not known.
struct rig_lens {
    struct lens_drive drive;
    int32_t commanded[LENS_AXES];
    struct lens_mean measured[LENS_AXES];  ///< last means
    int32_t offset[LENS_AXES];  ///< added to commands, away from the side of approach: see
                                ///< rig/lens_move.h
    uint8_t moving;             ///< bits of the axes that a move has
    struct lens_reading readings[LENS_AXES];      ///< the last ones; time 0: none
    uint64_t stopped_at_us;                       ///< time when it was last seen to have arrived
    struct rig_lens_track track[RIG_LENS_TRACK];  ///< the last readings, in turn
    uint32_t tracked;                             ///< number of readings; wraps
    uint64_t rest_us[LENS_AXES];  ///< an axis is at rest from then on; UINT64_MAX: it may move
    struct lens_learned learned;  ///< outlives the bring-up; see rig/rig_optics.h
    int32_t focused_q4;           ///< position where autofocus last found the object, 1/16 count
    uint64_t focused_us;          ///< time when autofocus last found the object; 0: never
};

/// The last autofocus of a camera. Positions in counts of the lens, or parts of a focus control.
struct rig_focus {
    bool done;          ///< it was searched to the end
    bool was_expected;  ///< the search began where the peak was expected
    struct rig_rectangle region_px;
    uint32_t duration_ms;        ///< time from the start of the call until this lens was done
    uint32_t frames;             ///< read
    struct focus_search search;  ///< the search with its curve and result
};

/// One of the two cameras, with its lens and its pan servo.
struct rig_camera {
    struct mt9t001 sensor;
    struct rig_lens lens;
    struct rig_focus focus;
    uint16_t pan_q4;               ///< pulse width of the last command
    uint64_t pan_stopped_at_us;    ///< time when the horn stops
    uint32_t exposure_us;          ///< exposure last set; 0: never set, or not known
    uint32_t initial_exposure_us;  ///< exposure found in the camera at the bring-up; 0: not known
    uint16_t gain_q3;
    uint16_t initial_gain_q3;  ///< gain found in the camera at the bring-up; 0: not known
    uint16_t focus_steps;      ///< steps of its own focus control; 0: it has none
    int32_t focus_part;        ///< 0 .. 1000 of the range of that, as set or found
    uint64_t settled_at_us;    ///< frames that begin at this time or later have the new settings
    bool streaming;            ///< its source delivers frames
    uint64_t started_us;       ///< time when its stream started
    bool frame_pending;        ///< the frame of the last trigger pulse has not been taken yet
};

/// An instrument. The caller owns it and everything it points to.
struct rig {
    struct rig_profile profile;
    struct rig_ports ports;
    struct rig_observer observer;
    enum rig_state state;
    struct rig_error last_error;
    /// Why the last rejected call failed: an argument that a part cannot accept is not a failure of
    /// that part.
    struct rig_error rejected;
    struct rig_part_health health[RIG_PARTS];

    struct fpga_bridge bridge;
    struct lens_controller lens_controller;
    struct rig_camera camera[RIG_SIDES];
    bool bridge_lost;       ///< the bridge does not accept feeds, and the rig was not yet
                            ///< made safe
    uint64_t triggered_us;  ///< time when the trigger line last went active
    struct hal_camera_format format;
    struct lens_object object;  ///< object that a lens was last focused on; outlives the bring-up
    uint32_t pairs;             ///< number taken since the bring-up
    uint64_t fed_us;            ///< last feed of the bridge's watchdog
    /// Time of the last feed that arrived since the bring-up (0: none), and the longest interval
    /// between two.
    uint64_t feed_arrived_us, feed_gap_us;
};

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// The instrument: its parts, what it is set to, and how it stands. No memory of its own, no
/// system: everything comes through the interfaces of hal/.
///
/// One thread at a time calls these functions. Every wait has a deadline on `clock`, asks `go_on`
/// at least every 100 ms, and feeds the bridge's watchdog meanwhile. After an error of a part the
/// message in `trouble` names it; functions that move something leave the rig in its safe state
/// then: servos where they are or at rest, motors stopped, streams off.
#ifndef VERGENCE_RIG_RIG_H
#define VERGENCE_RIG_RIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "device/fpga_bridge.h"
#include "device/fpga_bridge_camera.h"
#include "device/fpga_bridge_event.h"
#include "device/fpga_bridge_sensor.h"
#include "device/fpga_bridge_servo.h"
#include "device/lens_drive.h"
#include "device/lens_v3lc.h"
#include "device/mt9t001.h"
#include "hal/camera.h"
#include "hal/clock.h"
#include "hal/gpio.h"
#include "hal/i2c.h"
#include "hal/log.h"
#include "hal/uart.h"
#include "rig/profile.h"

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

/// Static storage; `part` must be one.
const char *rig_part_text(enum rig_part part);

/// Who opens what stands behind the ports. Devices come and go; the calls of a port whose device is
/// not there fail with ERROR_DEVICE.
struct rig_opener {
    /// Opens what is not open, and anew what has gone since. Called first thing in a bring-up.
    void (*open)(void *self);
    /// Why the device behind this part could not be opened, or does not start, for people: which,
    /// and what to do. NULL: it is open. The text lives until the next call.
    const char *(*missing)(void *self, enum rig_part part);
    /// What tells the camera behind this part from others of its kind, such as its serial number or
    /// port; NULL: nothing, or it is not open. The pointer itself may be NULL. The text lives until
    /// the next call.
    const char *(*identity)(void *self, enum rig_part part);
    void *self;
};

/// What the rig hangs on. `clock` is needed; others may be NULL where the profile has no use for
/// them. Behind a bridge both cameras are the same port.
struct rig_ports {
    const struct hal_clock *clock;
    const struct hal_i2c *i2c;
    const struct hal_gpio *gpio;
    const struct hal_camera *camera[RIG_SIDES];
    const struct hal_uart *lens_uart;
    const struct hal_log *log;
    const struct rig_opener *opener;  ///< NULL: what there is stays open
};

/// Who watches a long call. Any pointer may be NULL.
struct rig_observer {
    /// False: the call is to end as soon as the rig is safe, with ERROR_CANCELLED.
    bool (*go_on)(void *self);
    /// `done` of `total` of something; `what` is static storage.
    void (*progress)(void *self, const char *what, uint32_t done, uint32_t total);
    void *self;
};

enum { RIG_EXPOSURE_MOST_US = 10000000 };

/// What went wrong last.
struct rig_trouble {
    enum rig_part part;
    int error;       ///< 0: nothing
    char text[160];  ///< one line without an end: the part, what, and what to do
};

enum rig_state {
    RIG_DOWN,  ///< not brought up
    RIG_READY,
    RIG_SAFE,  ///< after a failure: `bringup` again
};

/// How a part was at the last look.
struct rig_part_health {
    bool present;
    int error;  ///< of the last use; 0: it worked
    uint32_t uses, failures;
    uint64_t last_us;  ///< of the last use that worked
};

/// An instrument. The caller owns it and everything that it points to.
struct rig {
    struct rig_profile profile;
    struct rig_ports ports;
    struct rig_observer observer;
    enum rig_state state;
    struct rig_trouble trouble;
    /// Why the last call that was refused was: a value that a part cannot take is no trouble of it.
    struct rig_trouble refusal;
    struct rig_part_health health[RIG_PARTS];

    struct fpga_bridge bridge;
    struct mt9t001 sensor[RIG_SIDES];
    struct lens_v3lc v3lc;
    struct lens_drive lens[RIG_SIDES];
    struct lens_abilities lens_abilities[RIG_SIDES];
    int32_t lens_commanded[RIG_SIDES][LENS_AXES];  ///< counts; INT32_MIN: never
    int32_t lens_position[RIG_SIDES][LENS_AXES];   ///< as read last; INT32_MIN: never, or no axis
    int32_t lens_trim[RIG_SIDES][LENS_AXES];       ///< added to commands: see rig/lens_move.h
    uint16_t pan_q4[RIG_SIDES];                    ///< asked for
    uint64_t pan_rest_us[RIG_SIDES];               ///< when the horn rests
    uint64_t lens_rest_us[RIG_SIDES];              ///< when the lens was seen to have arrived last
    uint32_t exposure_us[RIG_SIDES];  ///< as it was set; 0: nobody has, or it is not known
    uint32_t
        found_exposure_us[RIG_SIDES];  ///< that a camera still had at the bring-up; 0: as above
    uint16_t gain_q3[RIG_SIDES];
    uint64_t settled_us[RIG_SIDES];  ///< frames that begin then or later have what was set
    bool lost;                       ///< the bridge takes no feeds, and nothing was made safe yet
    bool streaming[RIG_SIDES];       ///< the source of that side gives frames
    uint64_t started_us[RIG_SIDES];  ///< when its stream was
    uint64_t triggered_us;           ///< when the trigger line went active last
    bool owed[RIG_SIDES];            ///< the frame of that pulse was not taken yet
    struct hal_camera_format format;
    uint32_t pairs;   ///< taken since the bring-up
    uint64_t fed_us;  ///< the bridge's watchdog, last
    /// When a feed last arrived since the bring-up (0: none did), and the longest time between two.
    uint64_t feed_arrived_us, feed_gap_us;
};

/// What an instrument of this profile needs and the ports do not have, such as "an I2C bus"; NULL:
/// nothing. Static storage.
const char *rig_ports_lack(const struct rig_profile *profile, const struct rig_ports *ports);

/// Copies profile, ports and observer (NULL: nobody watches). Touches nothing. The profile must be
/// one that rig_profile_check accepts, and the ports must lack nothing.
void rig_init(struct rig *self, const struct rig_profile *profile, const struct rig_ports *ports,
              const struct rig_observer *observer);

/// Finds and identifies every part of the profile, sets all to a known state, and centres nothing:
/// servos stay where they are until the first rig_pan. When a part is missing the others are still
/// looked at, so that one run tells all; the rig is RIG_SAFE then and the error is that of the
/// first.
int rig_bringup(struct rig *self);

/// Motors stop, streams end, servos get no more pulses, the trigger line rests. Goes on when a part
/// fails. The first error.
int rig_safe(struct rig *self);

/// To be called at least every 100 ms while nothing else runs: feeds the bridge's watchdog, notices
/// a bridge that has restarted or gone (ERROR_RESTARTED, ERROR_I2C_NACK; the rig is RIG_SAFE then).
int rig_idle(struct rig *self);

/// Looks at all parts without moving any; the first error. `health` tells of each.
int rig_check(struct rig *self);

/// Turns a camera: radians * 1e6 from its middle, positive to +x (right). Waits until it rests.
/// The horn comes from below, by three dead bands, in its last step. Measured in the simulated rig
/// (dead band 3 us = 0.29 degrees; 30 moves of 2 servos, half of them of up to 1.1 degrees):
/// without its repeatability it rests within 0.01 degrees, without the approach within 0.29; with
/// the repeatability of 0.3 degrees rms, which nothing can mend, it rests within 0.30 rms. Within
/// three dead bands of the lower limit of the servo there is no room for the approach.
/// Nothing tells where a horn is: a servo that is jammed or has no supply is not noticed, and there
/// is no ERROR_JAMMED. ERROR_RANGE: outside the profile's or the servo's limits; ERROR_TIMEOUT: the
/// bridge does not send the width. After ERROR_CANCELLED the servos stay where they were.
int rig_pan(struct rig *self, unsigned side, int32_t angle_urad);
/// Both at once; neither moves when one angle is refused.
int rig_pan_both(struct rig *self, int32_t left_urad, int32_t right_urad);
/// Where the bridge has the servo now.
int rig_pan_read(struct rig *self, unsigned side, int32_t *angle_urad);

/// Moves an axis of a lens (of both lenses at the same time when `sides` is 3; bit RIG_LEFT,
/// RIG_RIGHT) to a position and waits until it is there: from below, past the backlash. Says
/// ERROR_JAMMED when nothing moves, ERROR_TIMEOUT when it does not arrive or its controller does
/// not answer; how, and how soon: rig/lens_move.h. On any error all motors are at rest.
int rig_lens_go(struct rig *self, unsigned sides, enum lens_axis axis, int32_t position);
/// Reads the positions of a lens, each the middle one of three readings; they are kept in
/// `lens_position`.
int rig_lens_read(struct rig *self, unsigned side, int32_t positions[LENS_AXES]);
int rig_lens_limits(struct rig *self, unsigned side, enum lens_axis axis,
                    struct lens_limits *limits);

/// Exposure (1 .. RIG_EXPOSURE_MOST_US) and gain of one or both cameras (`sides` as above);
/// `*applied`: what was nearest. ERROR_RANGE and ERROR_UNSUPPORTED of a camera: `refusal` says
/// more.
int rig_exposure(struct rig *self, unsigned sides, uint32_t exposure_us, uint32_t *applied_us);
int rig_gain(struct rig *self, unsigned sides, uint16_t gain_q3, uint16_t *applied_q3);

/// The part of the sensor that frames show: the middle of it, every `skip`-th pixel. Behind the
/// bridge multiples of 2 * `skip` up to the whole sensor, else ERROR_RANGE; a camera with a port of
/// its own has sizes of its own, without `skip`, else ERROR_UNSUPPORTED, and `refusal` says more.
int rig_window(struct rig *self, uint16_t width_px, uint16_t height_px, uint8_t skip);

#ifdef __cplusplus
}
#endif

#endif

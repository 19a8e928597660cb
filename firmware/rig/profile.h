// SPDX-License-Identifier: Apache-2.0
/// Which parts an instrument has, and their numbers. What a profile lacks is refused with
/// ERROR_NOT_CONNECTED by whatever would need it.
#ifndef VERGENCE_RIG_PROFILE_H
#define VERGENCE_RIG_PROFILE_H

#include <stdbool.h>
#include <stdint.h>

#include "device/servo.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RIG_LEFT, RIG_RIGHT, RIG_SIDES };

enum {
    RIG_PROFILE_SENSOR_CLOCK_HZ = 48000000,  ///< the most that a sensor takes
    RIG_PROFILE_CAUSES = 3,
};

enum rig_profile_lenses {
    RIG_LENSES_FIXED,
    RIG_LENSES_V3LC,  ///< two lenses on one controller
    RIG_LENSES_V1LC,  ///< one lens, the left camera's
};

/// An instrument. Of what it lacks the numbers do not count.
struct rig_profile {
    char name[32];

    bool bridge;  ///< the FPGA, and with it the two sensors behind it, on one port for both
    uint8_t bridge_address, sensor_address[RIG_SIDES];
    uint32_t sensor_clock_hz;

    bool servos;
    struct servo_model servo[RIG_SIDES];
    uint16_t servo_slew_q4;  ///< greatest change from pulse to pulse, 1/16 us
    uint16_t watchdog_ms;    ///< silence after which the bridge brings the servos to rest
    int32_t pan_least_urad, pan_most_urad;
    uint32_t pan_repeatability_urad;  ///< standard deviation of an angle that is approached again

    enum rig_profile_lenses lenses;
    int32_t lens_counts_per_s[3];       ///< slowest motor that is not taken for jammed; LENS_AXES
    int32_t lens_backlash_counts;       ///< moves end from below, after going so far past
    int32_t lens_tolerance_counts;      ///< a move has arrived within this
    int32_t lens_repeatability_counts;  ///< a position that is approached again is within this
    int32_t lens_zoom_ppm;  ///< change of the focal length by one count of the zoom, in 1e-6 of it

    uint16_t width_px, height_px;  ///< full frames
    uint32_t frame_us;             ///< longest time from frame to frame where no sensor tells
    uint32_t skew_limit_us;        ///< of the two frames of a pair

    bool trigger;         ///< cameras with ports of their own that expose when a line goes active
    uint32_t trigger_us;  ///< how long it is active for a pair
};

/// The profiles that everybody has: "rig", "two-cameras", "two-cameras-lens". ERROR_MISSING.
int rig_profile_named(const char *name, struct rig_profile *profile);

/// Gives the instrument these lenses, with the numbers of their controller: how fast, how much
/// play, how exact. A V1LC counts 136 from end to end, a V3LC 550.
void rig_profile_set_lenses(struct rig_profile *profile, enum rig_profile_lenses lenses);

/// What is wrong with a profile: a field, and the range that it would have to be in. Fields are
/// named as the settings of the daemon are, without their "rig.". Static storage.
struct rig_profile_flaw {
    const char *field;
    int32_t least, most;
    /// Fields by whose values the range is what it is; NULL behind the last.
    const char *causes[RIG_PROFILE_CAUSES];
    bool even;   ///< it must be even
    bool other;  ///< it must be another than the first cause
};

/// Whether the numbers make sense together; ERROR_RANGE, and in `*flaw` the first that does not.
int rig_profile_check(const struct rig_profile *profile, struct rig_profile_flaw *flaw);

#ifdef __cplusplus
}
#endif

#endif

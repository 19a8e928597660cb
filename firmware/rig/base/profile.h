// SPDX-License-Identifier: Apache-2.0
/// The parts of an instrument, and their parameters. Operations that need a part which the profile
/// does not have fail with ERROR_NOT_CONNECTED.
#ifndef VERGENCE_RIG_BASE_PROFILE_H
#define VERGENCE_RIG_BASE_PROFILE_H

#include <stdbool.h>
#include <stdint.h>

#include "device/servo.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RIG_LEFT, RIG_RIGHT, RIG_SIDES };

enum {
    RIG_PROFILE_SENSOR_CLOCK_HZ = 48000000,  ///< fastest clock of a sensor
    RIG_PROFILE_CAUSES = 3,
};

enum rig_profile_lenses {
    RIG_LENSES_FIXED,
    RIG_LENSES_V3LC,  ///< two lenses on one controller
    RIG_LENSES_V1LC,  ///< one lens, on the left camera
};

/// An instrument. Parameters of parts that it does not have are ignored.
struct rig_profile {
    char name[32];

    bool bridge;  ///< the FPGA and the two sensors behind it, with one port for both
    uint8_t bridge_address, sensor_address[RIG_SIDES];
    uint32_t sensor_clock_hz;

    bool servos;
    struct servo_model servo[RIG_SIDES];
    uint16_t servo_slew_q4;  ///< largest change from pulse to pulse, 1/16 us
    uint16_t watchdog_ms;    ///< time without I2C after which the bridge brings the servos to rest
    int32_t pan_min_urad, pan_max_urad;
    uint32_t pan_repeatability_urad;  ///< standard deviation of an angle that is approached again

    enum rig_profile_lenses lenses;
    int32_t lens_counts_per_s[3];       ///< LENS_AXES; a slower motor counts as jammed
    int32_t lens_backlash_counts;       ///< moves overshoot downwards by this, and end from below
    int32_t lens_tolerance_counts;      ///< a move is complete within this
    int32_t lens_repeatability_counts;  ///< of a position that is approached again
    int32_t lens_zoom_ppm;  ///< relative change of the focal length by one count of zoom, 1e-6

    uint16_t width_px, height_px;  ///< full frames
    uint32_t frame_us;             ///< longest time between frames of cameras without a known rate
    uint32_t skew_limit_us;        ///< between the two frames of a pair

    bool trigger;         ///< cameras with ports of their own expose on the pulse of a line
    uint32_t trigger_us;  ///< length of that pulse
};

/// The built-in profiles "rig", "two-cameras" and "two-cameras-lens". ERROR_MISSING: another name.
int rig_profile_named(const char *name, struct rig_profile *profile);

/// Sets the lenses, and the parameters of their controller: speed, backlash, precision. A V1LC has
/// 136 counts from end to end, a V3LC 550.
void rig_profile_set_lenses(struct rig_profile *profile, enum rig_profile_lenses lenses);

/// An error of a profile: a field, and its range in the unit of struct rig_profile. Fields have the
/// names of the daemon's settings, without "rig.". Static storage.
struct rig_profile_error {
    const char *field;
    int32_t min, max;
    /// Fields that determine the range; NULL after the last.
    const char *causes[RIG_PROFILE_CAUSES];
    bool even;   ///< it must be even
    bool other;  ///< it must differ from the first cause
};

/// Whether the profile is consistent. ERROR_RANGE: `*profile_error` is the first one.
int rig_profile_check(const struct rig_profile *profile, struct rig_profile_error *profile_error);

#ifdef __cplusplus
}
#endif

#endif

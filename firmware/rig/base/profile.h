// SPDX-License-Identifier: Apache-2.0
/// The parts of an instrument, and their parameters. Operations that need a part which the profile
/// does not have fail with ERROR_NOT_CONNECTED.
#ifndef VERGENCE_RIG_BASE_PROFILE_H
#define VERGENCE_RIG_BASE_PROFILE_H

#include <stdbool.h>
#include <stdint.h>

#include "device/lens_driver.h"
#include "device/servo.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RIG_LEFT, RIG_RIGHT, RIG_SIDES };

/// "left", "right".
extern const char *const rig_side_names[RIG_SIDES];

enum {
    RIG_PROFILE_SENSOR_CLOCK_HZ = 48000000,  ///< fastest clock of a sensor
    RIG_PROFILE_CAUSES = 3,
};

/// Data sheet of the lenses and of the sensors; each 0: not known. See focus/lens_optics.h.
struct rig_profile_optics {
    uint32_t focal_length_wide_um, focal_length_tele_um;
    uint32_t focus_nearest_um;  ///< distance in focus at the upper end of the focus ring
    uint16_t f_number_open, f_number_closed;  ///< 1/1000
    uint16_t pixel_nm;                        ///< distance from pixel to pixel
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

    const struct lens_driver *lens_driver;  ///< driver of the lens controller; NULL: fixed lenses
    struct lens_settings lens;
    struct rig_profile_optics optics;

    uint16_t width_px, height_px;  ///< full frames
    uint32_t frame_us;             ///< longest time between frames of cameras without a known rate
    uint32_t skew_limit_us;        ///< longest time between the two frames of a pair
    uint8_t mains_hz;              ///< its lamps flicker at twice this; 0: constant light

    bool trigger;         ///< cameras with ports of their own expose on the pulse of a line
    uint32_t trigger_us;  ///< length of that pulse
};

/// The built-in profiles "rig", "two-cameras" and "two-cameras-lens". ERROR_MISSING: another name.
int rig_profile_named(const char *name, struct rig_profile *profile);

/// The word for lenses without motors, where others have the name of a lens driver.
#define RIG_LENSES_FIXED "fixed"

/// Sets the lens driver of this name, or RIG_LENSES_FIXED, and its settings. With another
/// controller come other lenses: their optics are then not known. ERROR_MISSING: another name.
int rig_profile_set_lenses(struct rig_profile *profile, const char *name);

/// Whether a side has a motorized lens, and whether that has an axis.
bool rig_has_lens(const struct rig_profile *profile, unsigned side);
bool rig_has_axis(const struct rig_profile *profile, unsigned side, enum lens_axis axis);

/// Half a period of the mains, in which flickering light repeats, us; 0: constant light.
uint32_t rig_mains_half_us(const struct rig_profile *profile);

/// Which ports the parts of an instrument need.
bool rig_needs_i2c(const struct rig_profile *profile);
bool rig_needs_lens_uart(const struct rig_profile *profile);

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

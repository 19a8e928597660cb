// SPDX-License-Identifier: Apache-2.0
#include "rig/base/profile.h"

#include <stddef.h>

#include "bridge_registers.h"
#include "core/error.h"
#include "core/invariant.h"
#include "device/mt9t001.h"

const char *const rig_side_names[RIG_SIDES] = {"left", "right"};

enum {
    // Behind the bridge's router; see fpga/README.md.
    LEFT_SENSOR_ADDRESS = 0x5C,
    RIGHT_SENSOR_ADDRESS = 0x5E,
    PAN_LIMIT_URAD = 523599,        // 30 degrees: far more than one object needs
    PAN_REPEATABILITY_URAD = 5236,  // 0.3 degrees: see rig_pan
    SLEW_Q4 = 480,                  // 2.9 degrees a pulse
    WATCHDOG_MS = 1000,
    // Every USB camera supports this, in dim light too.
    WEBCAM_WIDTH_PX = 640,
    WEBCAM_HEIGHT_PX = 480,
    WEBCAM_FRAME_US = 200000,
    // One after the other through one port; both at once, less than a frame apart.
    SKEW_IN_TURN_US = 1000000,
    SKEW_AT_ONCE_US = 50000,
    TRIGGER_US = 1000,
    MAINS_HZ = 50,
};

static struct rig_profile two_cameras(void) {
    return (struct rig_profile){.name = "two-cameras",
                                .width_px = WEBCAM_WIDTH_PX,
                                .height_px = WEBCAM_HEIGHT_PX,
                                .frame_us = WEBCAM_FRAME_US,
                                .skew_limit_us = SKEW_AT_ONCE_US,
                                .mains_hz = MAINS_HZ,
                                .trigger_us = TRIGGER_US};
}

static bool is_same(const char *a, const char *b) {
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}

int rig_profile_set_lenses(struct rig_profile *profile, const char *name) {
    const struct lens_driver *driver = lens_driver_named(name);
    if (driver == NULL && !is_same(name, RIG_LENSES_FIXED)) {
        return ERROR_MISSING;
    }
    if (driver != profile->lens_driver) {
        const uint16_t pixel_nm = profile->optics.pixel_nm;
        profile->optics = (struct rig_profile_optics){.pixel_nm = pixel_nm};
    }
    profile->lens_driver = driver;
    profile->lens = driver != NULL ? driver->settings : (struct lens_settings){.bits_per_s = 0};
    return ERROR_OK;
}

bool rig_has_lens(const struct rig_profile *profile, unsigned side) {
    return profile->lens_driver != NULL && side < profile->lens_driver->lenses;
}

bool rig_has_axis(const struct rig_profile *profile, unsigned side, enum lens_axis axis) {
    return rig_has_lens(profile, side) && (unsigned)axis < LENS_AXES &&
           (profile->lens_driver->abilities.axes >> axis & 1) != 0;
}

bool rig_needs_i2c(const struct rig_profile *profile) {
    return profile->bridge ||
           (profile->lens_driver != NULL && profile->lens_driver->port == LENS_PORT_I2C);
}

bool rig_needs_lens_uart(const struct rig_profile *profile) {
    return profile->lens_driver != NULL && profile->lens_driver->port == LENS_PORT_UART;
}

// The lenses of the profiles that have some.
static void set_default_lenses(struct rig_profile *profile) {
    const int error = rig_profile_set_lenses(profile, "v3lc");
    INVARIANT(error == ERROR_OK);
}

// The Rainbow H10x8.5 (8.5 to 85 mm) on the MT9T001. Its data sheet was not found: nearest distance
// and f-numbers are those of comparable lenses.
static struct rig_profile_optics rainbow_h10x85(void) {
    return (struct rig_profile_optics){.focal_length_wide_um = 8500,
                                       .focal_length_tele_um = 85000,
                                       .focus_nearest_um = 800000,
                                       .f_number_open = 1600,
                                       .f_number_closed = 16000,
                                       .pixel_nm = 3200};
}

static struct rig_profile two_cameras_lens(void) {
    struct rig_profile profile = two_cameras();
    static const char name[] = "two-cameras-lens";
    for (size_t i = 0; i < sizeof name; i++) {
        profile.name[i] = name[i];
    }
    set_default_lenses(&profile);
    return profile;
}

static struct rig_profile full_rig(void) {
    struct rig_profile profile = {
        .name = "rig",
        .bridge = true,
        .bridge_address = BRIDGE_I2C_ADDRESS,
        .sensor_address = {LEFT_SENSOR_ADDRESS, RIGHT_SENSOR_ADDRESS},
        .sensor_clock_hz = RIG_PROFILE_SENSOR_CLOCK_HZ,
        .servos = true,
        .servo = {servo_hs322hd(), servo_hs322hd()},
        .servo_slew_q4 = SLEW_Q4,
        .watchdog_ms = WATCHDOG_MS,
        .pan_min_urad = -PAN_LIMIT_URAD,
        .pan_max_urad = PAN_LIMIT_URAD,
        .pan_repeatability_urad = PAN_REPEATABILITY_URAD,
        .width_px = MT9T001_WIDTH_PX,
        .height_px = MT9T001_HEIGHT_PX,
        .frame_us = WEBCAM_FRAME_US,
        .skew_limit_us = SKEW_IN_TURN_US,
        .mains_hz = MAINS_HZ,
    };
    set_default_lenses(&profile);
    profile.optics = rainbow_h10x85();
    return profile;
}

int rig_profile_named(const char *name, struct rig_profile *profile) {
    const struct rig_profile all[] = {full_rig(), two_cameras(), two_cameras_lens()};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        struct rig_profile_error profile_error;
        INVARIANT(rig_profile_check(&all[i], &profile_error) == ERROR_OK);
        if (is_same(name, all[i].name)) {
            *profile = all[i];
            return ERROR_OK;
        }
    }
    return ERROR_MISSING;
}

uint32_t rig_mains_half_us(const struct rig_profile *profile) {
    enum { HALF_S_US = 500000 };
    return profile->mains_hz != 0 ? HALF_S_US / profile->mains_hz : 0;
}

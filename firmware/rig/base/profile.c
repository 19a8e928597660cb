// SPDX-License-Identifier: Apache-2.0
#include "rig/base/profile.h"

#include <stddef.h>

#include "bridge_registers.h"
#include "core/error.h"
#include "core/invariant.h"
#include "device/lens_drive.h"
#include "device/mt9t001.h"

enum {
    // Behind the bridge's router; see fpga/README.md.
    LEFT_SENSOR_ADDRESS = 0x5C,
    RIGHT_SENSOR_ADDRESS = 0x5E,
    PAN_LIMIT_URAD = 523599,        // 30 degrees: far more than one object needs
    PAN_REPEATABILITY_URAD = 5236,  // 0.3 degrees: see rig_pan
    SLEW_Q4 = 480,                  // 2.9 degrees a pulse
    WATCHDOG_MS = 1000,
    // V3LC, whose lenses have 550 counts.
    LENS_COUNTS_PER_S = 80,  // assumed: 7 s from end to end
    LENS_BACKLASH_COUNTS = 10,
    LENS_TOLERANCE_COUNTS = 4,
    LENS_REPEATABILITY_COUNTS = 4,
    LENS_ZOOM_PPM = 4187,  // 10x in 550 counts: ln(10) / 550
    // V1LC, whose lens has 136 counts: also 7 s, and the same shares of the travel, rounded up.
    LENS_V1LC_COUNTS_PER_S = 19,
    LENS_V1LC_BACKLASH_COUNTS = 3,
    LENS_V1LC_TOLERANCE_COUNTS = 2,
    LENS_V1LC_REPEATABILITY_COUNTS = 1,
    LENS_V1LC_ZOOM_PPM = 16931,
    // Every USB camera supports this, in dim light too.
    WEBCAM_WIDTH_PX = 640,
    WEBCAM_HEIGHT_PX = 480,
    WEBCAM_FRAME_US = 200000,
    // One after the other through one port; both at once, less than a frame apart.
    SKEW_IN_TURN_US = 1000000,
    SKEW_AT_ONCE_US = 50000,
    TRIGGER_US = 1000,
};

static struct rig_profile two_cameras(void) {
    return (struct rig_profile){.name = "two-cameras",
                                .lenses = RIG_LENSES_FIXED,
                                .width_px = WEBCAM_WIDTH_PX,
                                .height_px = WEBCAM_HEIGHT_PX,
                                .frame_us = WEBCAM_FRAME_US,
                                .skew_limit_us = SKEW_AT_ONCE_US,
                                .trigger_us = TRIGGER_US};
}

void rig_profile_set_lenses(struct rig_profile *profile, enum rig_profile_lenses lenses) {
    const bool v1lc = lenses == RIG_LENSES_V1LC, fixed = lenses == RIG_LENSES_FIXED;
    const int32_t counts_per_s = v1lc ? LENS_V1LC_COUNTS_PER_S : LENS_COUNTS_PER_S;
    const int32_t backlash = v1lc ? LENS_V1LC_BACKLASH_COUNTS : LENS_BACKLASH_COUNTS;
    const int32_t tolerance = v1lc ? LENS_V1LC_TOLERANCE_COUNTS : LENS_TOLERANCE_COUNTS;
    profile->lenses = lenses;
    for (int axis = 0; axis < LENS_AXES; axis++) {
        profile->lens_counts_per_s[axis] = fixed ? 0 : counts_per_s;
    }
    profile->lens_backlash_counts = fixed ? 0 : backlash;
    profile->lens_tolerance_counts = fixed ? 0 : tolerance;
    profile->lens_repeatability_counts = fixed  ? 0
                                         : v1lc ? LENS_V1LC_REPEATABILITY_COUNTS
                                                : LENS_REPEATABILITY_COUNTS;
    profile->lens_zoom_ppm = fixed ? 0 : v1lc ? LENS_V1LC_ZOOM_PPM : LENS_ZOOM_PPM;
}

static struct rig_profile two_cameras_lens(void) {
    struct rig_profile profile = two_cameras();
    static const char name[] = "two-cameras-lens";
    for (size_t i = 0; i < sizeof name; i++) {
        profile.name[i] = name[i];
    }
    rig_profile_set_lenses(&profile, RIG_LENSES_V3LC);
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
    };
    rig_profile_set_lenses(&profile, RIG_LENSES_V3LC);
    return profile;
}

static bool is_same(const char *a, const char *b) {
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
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

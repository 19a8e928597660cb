// SPDX-License-Identifier: Apache-2.0
#include "rig/profile.h"

#include <stddef.h>

#include "bridge_registers.h"
#include "core/error.h"
#include "core/invariant.h"
#include "device/lens_drive.h"

enum {
    // Behind the bridge's router; see fpga/README.md.
    LEFT_SENSOR_ADDRESS = 0x5C,
    RIGHT_SENSOR_ADDRESS = 0x5E,
    SENSOR_CLOCK_HZ = 48000000,
    SENSOR_CLOCK_LEAST_HZ = 1000000,
    PAN_LIMIT_URAD = 523599,  // 30 degrees: far more than it takes to look at one thing
    SLEW_Q4 = 480,            // 2.9 degrees in a pulse
    SLEW_MOST_Q4 = 2047,
    WATCHDOG_MS = 1000,
    // Less would fire while a transfer is tried again.
    WATCHDOG_LEAST_MS = 400,
    // More would leave the servos alone for too long.
    WATCHDOG_MOST_MS = 1500,
    // Of a V3LC, whose lenses have 550 counts.
    LENS_COUNTS_PER_S = 80,  // assumed: 7 s from end to end
    LENS_BACKLASH_COUNTS = 10,
    LENS_TOLERANCE_COUNTS = 4,
    // The same of a V1LC, whose lens has 136: 7 s, and as large a part of the way, rounded up.
    LENS_V1LC_COUNTS_PER_S = 19,
    LENS_V1LC_BACKLASH_COUNTS = 3,
    LENS_V1LC_TOLERANCE_COUNTS = 2,
    FULL_WIDTH_PX = 2048,
    FULL_HEIGHT_PX = 1536,
    // What every USB camera can do, in dim light too.
    WEBCAM_WIDTH_PX = 640,
    WEBCAM_HEIGHT_PX = 480,
    WEBCAM_FRAME_US = 200000,
    // In turn through one port; and both at once, where less than a frame lies between.
    SKEW_IN_TURN_US = 1000000,
    SKEW_AT_ONCE_US = 50000,
    SIZE_LEAST_PX = 16,
    SIZE_MOST_PX = 16384,
    FRAME_MOST_US = 60000000,
};

static struct rig_profile two_cameras(void) {
    return (struct rig_profile){.name = "two-cameras",
                                .lenses = RIG_LENSES_FIXED,
                                .width_px = WEBCAM_WIDTH_PX,
                                .height_px = WEBCAM_HEIGHT_PX,
                                .frame_us = WEBCAM_FRAME_US,
                                .skew_limit_us = SKEW_AT_ONCE_US};
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
        .sensor_clock_hz = SENSOR_CLOCK_HZ,
        .servos = true,
        .servo = {servo_hs322hd(), servo_hs322hd()},
        .servo_slew_q4 = SLEW_Q4,
        .watchdog_ms = WATCHDOG_MS,
        .pan_least_urad = -PAN_LIMIT_URAD,
        .pan_most_urad = PAN_LIMIT_URAD,
        .width_px = FULL_WIDTH_PX,
        .height_px = FULL_HEIGHT_PX,
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
        const char *what = NULL;
        INVARIANT(rig_profile_check(&all[i], &what) == ERROR_OK);
        if (is_same(name, all[i].name)) {
            *profile = all[i];
            return ERROR_OK;
        }
    }
    return ERROR_MISSING;
}

static int refuse(int error, const char *field, const char **what) {
    *what = field;
    return error;
}

static int check_bridge(const struct rig_profile *profile, const char **what) {
    const uint8_t *address = profile->sensor_address;
    if (profile->bridge_address != BRIDGE_I2C_ADDRESS) {
        return refuse(ERROR_RANGE, "bridge_address", what);
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        if (address[side] < 0x08 || address[side] > 0x77 ||
            address[side] == profile->bridge_address) {
            return refuse(ERROR_RANGE, "sensor_address", what);
        }
    }
    if (address[RIG_LEFT] == address[RIG_RIGHT]) {
        return refuse(ERROR_ARGUMENT, "sensor_address", what);
    }
    if (profile->sensor_clock_hz < SENSOR_CLOCK_LEAST_HZ ||
        profile->sensor_clock_hz > SENSOR_CLOCK_HZ) {
        return refuse(ERROR_RANGE, "sensor_clock_hz", what);
    }
    return ERROR_OK;
}

static int check_servos(const struct rig_profile *profile, const char **what) {
    if (!profile->bridge) {
        return refuse(ERROR_ARGUMENT, "servos", what);
    }
    if (profile->servo_slew_q4 > SLEW_MOST_Q4) {
        return refuse(ERROR_RANGE, "servo_slew_q4", what);
    }
    if (profile->watchdog_ms < WATCHDOG_LEAST_MS || profile->watchdog_ms > WATCHDOG_MOST_MS) {
        return refuse(ERROR_RANGE, "watchdog_ms", what);
    }
    if (profile->pan_least_urad >= profile->pan_most_urad) {
        return refuse(ERROR_RANGE, "pan_least_urad", what);
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct servo_model *servo = &profile->servo[side];
        uint16_t width_q4 = 0;
        if (servo->q4_per_rad == 0 || servo->urad_per_s == 0 ||
            servo->least_q4 >= servo->centre_q4 || servo->centre_q4 >= servo->most_q4) {
            return refuse(ERROR_RANGE, "servo", what);
        }
        if (servo_width_q4(servo, profile->pan_least_urad, &width_q4) != ERROR_OK) {
            return refuse(ERROR_RANGE, "pan_least_urad", what);
        }
        if (servo_width_q4(servo, profile->pan_most_urad, &width_q4) != ERROR_OK) {
            return refuse(ERROR_RANGE, "pan_most_urad", what);
        }
    }
    return ERROR_OK;
}

static int check_lenses(const struct rig_profile *profile, const char **what) {
    if (profile->lenses > RIG_LENSES_V1LC) {
        return refuse(ERROR_ARGUMENT, "lenses", what);
    }
    if (profile->lenses == RIG_LENSES_FIXED) {
        return ERROR_OK;
    }
    for (int axis = 0; axis < LENS_AXES; axis++) {
        if (profile->lens_counts_per_s[axis] < 1 || profile->lens_counts_per_s[axis] > 100000) {
            return refuse(ERROR_RANGE, "lens_counts_per_s", what);
        }
    }
    if (profile->lens_backlash_counts < 0 || profile->lens_backlash_counts > 100) {
        return refuse(ERROR_RANGE, "lens_backlash_counts", what);
    }
    if (profile->lens_tolerance_counts < 1 || profile->lens_tolerance_counts > 100) {
        return refuse(ERROR_RANGE, "lens_tolerance_counts", what);
    }
    return ERROR_OK;
}

int rig_profile_check(const struct rig_profile *profile, const char **what) {
    INVARIANT(profile != NULL && what != NULL);
    if (profile->width_px < SIZE_LEAST_PX || profile->width_px > SIZE_MOST_PX ||
        (profile->bridge && profile->width_px > FULL_WIDTH_PX)) {
        return refuse(ERROR_RANGE, "width_px", what);
    }
    if (profile->height_px < SIZE_LEAST_PX || profile->height_px > SIZE_MOST_PX ||
        (profile->bridge && profile->height_px > FULL_HEIGHT_PX)) {
        return refuse(ERROR_RANGE, "height_px", what);
    }
    if (profile->width_px % 2 != 0 || profile->height_px % 2 != 0) {
        return refuse(ERROR_RANGE, profile->width_px % 2 != 0 ? "width_px" : "height_px", what);
    }
    if (profile->frame_us < 1000 || profile->frame_us > FRAME_MOST_US) {
        return refuse(ERROR_RANGE, "frame_us", what);
    }
    if (profile->skew_limit_us < 1 || profile->skew_limit_us > FRAME_MOST_US) {
        return refuse(ERROR_RANGE, "skew_limit_us", what);
    }
    int error = profile->bridge ? check_bridge(profile, what) : ERROR_OK;
    if (error == ERROR_OK && profile->servos) {
        error = check_servos(profile, what);
    }
    return error == ERROR_OK ? check_lenses(profile, what) : error;
}

// SPDX-License-Identifier: Apache-2.0
// Consistency of a profile: each number has a range, and other fields decide whether it is used and
// how far it extends.
#include <stddef.h>

#include "bridge_registers.h"
#include "core/error.h"
#include "core/invariant.h"
#include "device/fpga_bridge.h"
#include "device/mt9t001.h"
#include "rig/base/profile.h"

enum {
    SENSOR_CLOCK_MIN_HZ = 1000000,
    // I2C reserves the addresses outside.
    ADDRESS_MIN = 0x08,
    ADDRESS_MAX = 0x77,
    Q4_PER_RAD_MAX = 1000000,
    URAD_PER_S_MAX = 100000000,
    // A shorter one would fire while a transfer is repeated.
    WATCHDOG_MIN_MS = 400,
    // A longer one would leave the servos uncontrolled for too long.
    WATCHDOG_MAX_MS = 1500,
    LENS_BITS_PER_S_MIN = 300,
    LENS_BITS_PER_S_MAX = 921600,
    LENS_COUNTS_PER_S_MAX = 100000,
    LENS_COUNTS_MAX = 1000,
    LENS_ZOOM_MAX_PPM = 100000,
    PAN_REPEATABILITY_MAX_URAD = 174533,  // 10 degrees
    SIZE_MIN_PX = 16,
    SIZE_MAX_PX = 16384,
    FRAME_MIN_US = 1000,
    FRAME_MAX_US = 60000000,
    // The trigger inputs of such cameras detect this reliably.
    TRIGGER_MIN_US = 100,
    TRIGGER_MAX_US = 1000000,
    MAINS_MAX_HZ = 100,
    FOCAL_LENGTH_MAX_UM = 1000000,
    FOCUS_NEAREST_MAX_UM = 100000000,
    F_NUMBER_MAX = 64000,
    PIXEL_MAX_NM = 50000,
};

/// A field's value, and its range.
struct limit {
    int64_t value;
    struct rig_profile_error range;
};

static int check_all(const struct limit *limits, size_t count,
                     struct rig_profile_error *profile_error) {
    for (size_t i = 0; i < count; i++) {
        const struct rig_profile_error *range = &limits[i].range;
        const int64_t value = limits[i].value;
        INVARIANT(range->min <= range->max);
        if (value < range->min || value > range->max || (range->even && value % 2 != 0)) {
            *profile_error = *range;
            return ERROR_RANGE;
        }
    }
    return ERROR_OK;
}

#define CHECK(limits, profile_error) \
    check_all(limits, sizeof(limits) / sizeof(limits)[0], profile_error)

static int check_frames(const struct rig_profile *profile,
                        struct rig_profile_error *profile_error) {
    // The system reports what cameras with ports of their own support.
    const char *cause = profile->bridge ? "bridge" : NULL;
    const int32_t width_px = profile->bridge ? MT9T001_WIDTH_PX : SIZE_MAX_PX;
    const int32_t height_px = profile->bridge ? MT9T001_HEIGHT_PX : SIZE_MAX_PX;
    const struct limit limits[] = {
        {profile->width_px, {"width", SIZE_MIN_PX, width_px, .causes = {cause}, .even = true}},
        {profile->height_px, {"height", SIZE_MIN_PX, height_px, .causes = {cause}, .even = true}},
        {profile->frame_us, {"frame_interval", FRAME_MIN_US, FRAME_MAX_US, .causes = {NULL}}},
        {profile->skew_limit_us, {"skew_limit", 1, FRAME_MAX_US, .causes = {NULL}}},
        {profile->mains_hz, {"mains", 0, MAINS_MAX_HZ, .causes = {NULL}}},
    };
    return CHECK(limits, profile_error);
}

/// Whether an I2C address differs from another one.
static int check_address(uint8_t address, uint8_t taken, const char *field, const char *other,
                         struct rig_profile_error *profile_error) {
    if (address != taken) {
        return ERROR_OK;
    }
    *profile_error = (struct rig_profile_error){field, ADDRESS_MIN, ADDRESS_MAX, .causes = {other},
                                                .other = true};
    return ERROR_RANGE;
}

static int check_bridge(const struct rig_profile *profile,
                        struct rig_profile_error *profile_error) {
    static const char bridge[] = "bridge_address";
    static const char left[] = "sensor_address_left", right[] = "sensor_address_right";
    const uint8_t *address = profile->sensor_address;
    const struct limit limits[] = {
        {profile->bridge_address,
         {bridge, BRIDGE_I2C_ADDRESS, BRIDGE_I2C_ADDRESS, .causes = {"bridge"}}},
        {address[RIG_LEFT], {left, ADDRESS_MIN, ADDRESS_MAX, .causes = {"bridge"}}},
        {address[RIG_RIGHT], {right, ADDRESS_MIN, ADDRESS_MAX, .causes = {"bridge"}}},
        {profile->sensor_clock_hz,
         {"sensor_clock", SENSOR_CLOCK_MIN_HZ, RIG_PROFILE_SENSOR_CLOCK_HZ, .causes = {"bridge"}}},
        {profile->watchdog_ms,
         {"servo_watchdog", WATCHDOG_MIN_MS, WATCHDOG_MAX_MS, .causes = {"bridge"}}},
    };
    int error = CHECK(limits, profile_error);
    if (error == ERROR_OK) {
        error =
            check_address(address[RIG_LEFT], profile->bridge_address, left, bridge, profile_error);
    }
    if (error == ERROR_OK) {
        error = check_address(address[RIG_RIGHT], profile->bridge_address, right, bridge,
                              profile_error);
    }
    return error == ERROR_OK
               ? check_address(address[RIG_RIGHT], address[RIG_LEFT], right, left, profile_error)
               : error;
}

/// Names of the fields of a servo.
struct servo_fields {
    const char *centre, *min, *max, *q4_per_rad, *urad_per_s;
};

static const struct servo_fields servo_fields[RIG_SIDES] = {
    {"servo_left_centre", "servo_left_min", "servo_left_max", "servo_left_scale",
     "servo_left_speed"},
    {"servo_right_centre", "servo_right_min", "servo_right_max", "servo_right_scale",
     "servo_right_speed"},
};

/// Within the bridge's own limits of a pulse.
static int check_servo(const struct rig_profile *profile, unsigned side,
                       struct rig_profile_error *profile_error) {
    const struct servo_model *servo = &profile->servo[side];
    const struct servo_fields *fields = &servo_fields[side];
    const struct bridge_register *min = fpga_bridge_register(BRIDGE_SERVO0_MIN_Q4);
    const struct bridge_register *max = fpga_bridge_register(BRIDGE_SERVO0_MAX_Q4);
    const int32_t centre_q4 = servo->centre_q4;
    const struct limit first[] = {
        {centre_q4, {fields->centre, min->min + 1, max->max - 1, .causes = {"servos"}}},
        {servo->q4_per_rad, {fields->q4_per_rad, 1, Q4_PER_RAD_MAX, .causes = {"servos"}}},
        {servo->urad_per_s, {fields->urad_per_s, 1, URAD_PER_S_MAX, .causes = {"servos"}}},
    };
    const int error = CHECK(first, profile_error);
    if (error != ERROR_OK) {
        return error;
    }
    const int32_t min_max_q4 = min->max < centre_q4 ? min->max : centre_q4 - 1;
    const int32_t max_min_q4 = max->min > centre_q4 ? max->min : centre_q4 + 1;
    const struct limit limits[] = {
        {servo->min_q4, {fields->min, min->min, min_max_q4, .causes = {fields->centre, "servos"}}},
        {servo->max_q4, {fields->max, max_min_q4, max->max, .causes = {fields->centre, "servos"}}},
    };
    return CHECK(limits, profile_error);
}

/// Within the range of both servos.
static int check_pan(const struct rig_profile *profile, struct rig_profile_error *profile_error) {
    int32_t min_urad = INT32_MIN, max_urad = INT32_MAX;
    const struct servo_fields *leftmost = NULL, *rightmost = NULL;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const struct servo_model *servo = &profile->servo[side];
        const int32_t from_urad = servo_angle_urad(servo, servo->min_q4);
        const int32_t to_urad = servo_angle_urad(servo, servo->max_q4);
        if (leftmost == NULL || from_urad > min_urad) {
            min_urad = from_urad;
            leftmost = &servo_fields[side];
        }
        if (rightmost == NULL || to_urad < max_urad) {
            max_urad = to_urad;
            rightmost = &servo_fields[side];
        }
    }
    // The limits of each servo are on both sides of its centre.
    INVARIANT(min_urad < 0 && max_urad > 0);
    const struct limit limits[] = {
        {profile->pan_max_urad,
         {"pan_max", min_urad + 1, max_urad,
          .causes = {rightmost->max, rightmost->centre, rightmost->q4_per_rad}}},
        {profile->pan_min_urad,
         {"pan_min", min_urad, profile->pan_max_urad - 1,
          .causes = {leftmost->min, leftmost->centre, leftmost->q4_per_rad}}},
    };
    const int error = CHECK(limits, profile_error);
    if (error != ERROR_OK && profile->pan_min_urad >= profile->pan_max_urad &&
        profile_error->field == limits[1].range.field) {
        profile_error->causes[0] = "pan_max";
        profile_error->causes[1] = NULL;
    }
    return error;
}

static int check_servos(const struct rig_profile *profile,
                        struct rig_profile_error *profile_error) {
    const struct bridge_register *slew = fpga_bridge_register(BRIDGE_SERVO0_SLEW_Q4);
    const struct limit limits[] = {
        // The bridge generates the pulses.
        {!profile->bridge, {"servos", 0, 0, .causes = {"bridge"}}},
        {profile->servo_slew_q4, {"servo_slew", 1, slew->max, .causes = {"servos"}}},
        {profile->pan_repeatability_urad,
         {"pan_repeatability", 0, PAN_REPEATABILITY_MAX_URAD, .causes = {"servos"}}},
    };
    int error = CHECK(limits, profile_error);
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        error = check_servo(profile, side, profile_error);
    }
    return error == ERROR_OK ? check_pan(profile, profile_error) : error;
}

/// Names of the fields of an axis.
struct axis_fields {
    const char *min, *max, *speed, *backlash, *tolerance, *approach;
};

#define AXIS_FIELDS(axis)                                                                 \
    {                                                                                     \
        "lens_" axis "_min", "lens_" axis "_max", "lens_" axis "_speed_min",              \
            "lens_" axis "_backlash", "lens_" axis "_tolerance", "lens_" axis "_approach" \
    }

static int check_axis(const struct rig_profile *profile, enum lens_axis axis,
                      struct rig_profile_error *profile_error) {
    static const struct axis_fields all_fields[LENS_AXES] = {
        AXIS_FIELDS("zoom"), AXIS_FIELDS("focus"), AXIS_FIELDS("iris")};
    const struct axis_fields *fields = &all_fields[axis];
    const struct lens_axis_settings *values = &profile->lens.axis[axis];
    const int32_t max = profile->lens_driver->position_max;
    const struct limit range[] = {{values->min, {fields->min, 0, max - 1, .causes = {"lenses"}}}};
    const int error = CHECK(range, profile_error);
    if (error != ERROR_OK) {
        return error;
    }
    const struct limit limits[] = {
        {values->max, {fields->max, values->min + 1, max, .causes = {fields->min, "lenses"}}},
        {values->counts_per_s, {fields->speed, 1, LENS_COUNTS_PER_S_MAX, .causes = {"lenses"}}},
        {values->backlash_counts, {fields->backlash, 0, LENS_COUNTS_MAX, .causes = {"lenses"}}},
        {values->tolerance_counts, {fields->tolerance, 1, LENS_COUNTS_MAX, .causes = {"lenses"}}},
        {values->approach,
         {fields->approach, LENS_FROM_BELOW, LENS_FROM_ABOVE, .causes = {"lenses"}}},
    };
    return CHECK(limits, profile_error);
}

static int check_lenses(const struct rig_profile *profile,
                        struct rig_profile_error *profile_error) {
    const struct lens_settings *lens = &profile->lens;
    int error = ERROR_OK;
    for (unsigned axis = 0; axis < LENS_AXES && error == ERROR_OK; axis++) {
        if (rig_has_axis(profile, RIG_LEFT, (enum lens_axis)axis)) {
            error = check_axis(profile, (enum lens_axis)axis, profile_error);
        }
    }
    if (error != ERROR_OK) {
        return error;
    }
    const bool uart = rig_needs_lens_uart(profile);
    const struct limit limits[] = {
        {uart ? lens->bits_per_s : LENS_BITS_PER_S_MIN,
         {"lens_baud", LENS_BITS_PER_S_MIN, LENS_BITS_PER_S_MAX, .causes = {"lenses"}}},
        {uart ? ADDRESS_MIN : lens->address,
         {"lens_address", ADDRESS_MIN, ADDRESS_MAX, .causes = {"lenses"}}},
        {lens->repeatability_counts,
         {"lens_repeatability", 0, LENS_COUNTS_MAX, .causes = {"lenses"}}},
        {lens->zoom_ppm, {"lens_zoom_step", 0, LENS_ZOOM_MAX_PPM, .causes = {"lenses"}}},
    };
    return CHECK(limits, profile_error);
}

/// Each may be unknown; of a pair both are known or none.
static int check_optics(const struct rig_profile *profile,
                        struct rig_profile_error *profile_error) {
    static const char wide[] = "focal_length_wide", open[] = "f_number_open";
    const struct rig_profile_optics *optics = &profile->optics;
    const int32_t wide_um = (int32_t)optics->focal_length_wide_um;
    const struct limit first[] = {
        {optics->focal_length_wide_um, {wide, 0, FOCAL_LENGTH_MAX_UM - 1, .causes = {NULL}}},
        {optics->f_number_open, {open, 0, F_NUMBER_MAX - 1, .causes = {NULL}}},
        {optics->pixel_nm, {"pixel_pitch", 0, PIXEL_MAX_NM, .causes = {NULL}}},
    };
    const int error = CHECK(first, profile_error);
    if (error != ERROR_OK) {
        return error;
    }
    const bool zooms = wide_um > 0, stops_down = optics->f_number_open > 0;
    // The thin lens of focus/lens_optics.h is for objects beyond two focal lengths.
    const int64_t nearest_min_um = 3 * (int64_t)optics->focal_length_tele_um;
    const struct limit limits[] = {
        {optics->focal_length_tele_um,
         {"focal_length_tele", zooms ? wide_um + 1 : 0, zooms ? FOCAL_LENGTH_MAX_UM : 0,
          .causes = {wide}}},
        {optics->f_number_closed,
         {"f_number_closed", stops_down ? optics->f_number_open + 1 : 0,
          stops_down ? F_NUMBER_MAX : 0, .causes = {open}}},
        {optics->focus_nearest_um > 0 ? optics->focus_nearest_um : nearest_min_um,
         {"focus_nearest", (int32_t)nearest_min_um, FOCUS_NEAREST_MAX_UM,
          .causes = {"focal_length_tele"}}},
    };
    return CHECK(limits, profile_error);
}

static int check_trigger(const struct rig_profile *profile,
                         struct rig_profile_error *profile_error) {
    const struct limit limits[] = {
        // The sensors behind the bridge run freely.
        {profile->bridge, {"trigger", 0, 0, .causes = {"bridge"}}},
        {profile->trigger_us,
         {"trigger_pulse", TRIGGER_MIN_US, TRIGGER_MAX_US, .causes = {"trigger"}}},
    };
    return CHECK(limits, profile_error);
}

int rig_profile_check(const struct rig_profile *profile, struct rig_profile_error *profile_error) {
    INVARIANT(profile != NULL && profile_error != NULL);
    int error = check_frames(profile, profile_error);
    if (error == ERROR_OK && profile->bridge) {
        error = check_bridge(profile, profile_error);
    }
    if (error == ERROR_OK && profile->trigger) {
        error = check_trigger(profile, profile_error);
    }
    if (error == ERROR_OK && profile->servos) {
        error = check_servos(profile, profile_error);
    }
    if (error == ERROR_OK && profile->lens_driver != NULL) {
        error = check_lenses(profile, profile_error);
    }
    return error == ERROR_OK ? check_optics(profile, profile_error) : error;
}

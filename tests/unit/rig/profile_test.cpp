// SPDX-License-Identifier: Apache-2.0
// The profiles that everybody has, and numbers that make no sense.
#include "rig/base/profile.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>

#include "core/error.h"
#include "device/lens_drive.h"
#include "device/lens_v3lc.h"

namespace {

rig_profile named(const char *name) {
    rig_profile profile{};
    REQUIRE(rig_profile_named(name, &profile) == ERROR_OK);
    return profile;
}

}  // namespace

TEST_CASE("the profiles that everybody has are good, and have the parts that their names say") {
    for (const char *name : {"rig", "two-cameras", "two-cameras-lens"}) {
        const rig_profile profile = named(name);
        rig_profile_error profile_error{};
        CHECK(rig_profile_check(&profile, &profile_error) == ERROR_OK);
        CHECK(std::string(profile.name) == name);
    }
    CHECK(named("rig").bridge);
    CHECK(named("rig").servos);
    CHECK(named("rig").lenses == RIG_LENSES_V3LC);
    CHECK(!named("two-cameras").bridge);
    CHECK(named("two-cameras").lenses == RIG_LENSES_FIXED);
    CHECK(!named("two-cameras-lens").bridge);
    CHECK(named("two-cameras-lens").lenses == RIG_LENSES_V3LC);
}

TEST_CASE("a lens gets the numbers of its controller") {
    rig_profile profile = named("two-cameras");
    rig_profile_error profile_error{};
    for (const auto lenses : {RIG_LENSES_V1LC, RIG_LENSES_V3LC, RIG_LENSES_FIXED}) {
        rig_profile_set_lenses(&profile, lenses);
        CHECK(profile.lenses == lenses);
        CHECK(rig_profile_check(&profile, &profile_error) == ERROR_OK);
        const int32_t counts = lenses == RIG_LENSES_V1LC ? LENS_V1LC_MAX - LENS_V1LC_MIN
                                                         : LENS_V3LC_MAX - LENS_V3LC_MIN;
        for (int axis = 0; axis < LENS_AXES && lenses != RIG_LENSES_FIXED; axis++) {
            // Both take up to 7 s from end to end.
            const double travel_s = double(counts) / profile.lens_counts_per_s[axis];
            CHECK(travel_s >= 6.8);
            CHECK(travel_s <= 7.5);
        }
        CHECK(profile.lens_backlash_counts * 40 <= counts);
    }
    CHECK(profile.lens_tolerance_counts == 0);
}

TEST_CASE("other names are refused, and change nothing") {
    rig_profile profile{};
    profile.width_px = 7;
    for (const char *name : {"", "ri", "rigs", "two-cameras-lenses", "Rig"}) {
        CHECK(rig_profile_named(name, &profile) == ERROR_MISSING);
    }
    CHECK(profile.width_px == 7);
}

TEST_CASE("each number that makes no sense is named") {
    const struct {
        const char *base, *field;
        std::function<void(rig_profile &)> corrupt;
    } cases[] = {
        {"rig", "bridge_address", [](rig_profile &p) { p.bridge_address = 0x2D; }},
        {"rig", "sensor_address_right", [](rig_profile &p) { p.sensor_address[1] = 0x78; }},
        {"rig", "sensor_address_left", [](rig_profile &p) { p.sensor_address[0] = 0x2C; }},
        {"rig", "sensor_address_right", [](rig_profile &p) { p.sensor_address[0] = 0x5E; }},
        {"rig", "sensor_clock", [](rig_profile &p) { p.sensor_clock_hz = 0; }},
        {"rig", "sensor_clock", [](rig_profile &p) { p.sensor_clock_hz = 48000001; }},
        {"rig", "servo_slew", [](rig_profile &p) { p.servo_slew_q4 = 2048; }},
        {"rig", "servo_watchdog", [](rig_profile &p) { p.watchdog_ms = 0; }},
        {"rig", "servo_watchdog", [](rig_profile &p) { p.watchdog_ms = 5000; }},
        {"rig", "pan_min", [](rig_profile &p) { p.pan_min_urad = p.pan_max_urad; }},
        {"rig", "pan_min", [](rig_profile &p) { p.pan_min_urad = -3000000; }},
        {"rig", "pan_max", [](rig_profile &p) { p.pan_max_urad = 3000000; }},
        {"rig", "servo_right_scale", [](rig_profile &p) { p.servo[1].q4_per_rad = 0; }},
        {"rig", "servo_left_min", [](rig_profile &p) { p.servo[0].min_q4 = p.servo[0].centre_q4; }},
        {"rig", "servo_right_min", [](rig_profile &p) { p.servo[1].min_q4 = 9599; }},
        {"rig", "servo_right_max", [](rig_profile &p) { p.servo[1].max_q4 = 38401; }},
        {"rig", "servo_slew", [](rig_profile &p) { p.servo_slew_q4 = 0; }},
        {"rig", "servo_watchdog",
         [](rig_profile &p) {
             p.servos = false;
             p.watchdog_ms = 0;
         }},
        {"rig", "width", [](rig_profile &p) { p.width_px = 2050; }},
        {"rig", "height", [](rig_profile &p) { p.height_px = 1538; }},
        {"two-cameras", "servos", [](rig_profile &p) { p.servos = true; }},
        {"two-cameras", "width", [](rig_profile &p) { p.width_px = 0; }},
        {"two-cameras", "width", [](rig_profile &p) { p.width_px = 641; }},
        {"two-cameras", "height", [](rig_profile &p) { p.height_px = 481; }},
        {"two-cameras", "frame_interval", [](rig_profile &p) { p.frame_us = 0; }},
        {"two-cameras", "skew_limit", [](rig_profile &p) { p.skew_limit_us = 0; }},
        {"rig", "trigger", [](rig_profile &p) { p.trigger = true; }},
        {"two-cameras", "trigger_pulse",
         [](rig_profile &p) {
             p.trigger = true;
             p.trigger_us = 99;
         }},
        {"two-cameras-lens", "trigger_pulse",
         [](rig_profile &p) {
             p.trigger = true;
             p.trigger_us = 1000001;
         }},
        {"two-cameras-lens", "lens_iris_speed_min",
         [](rig_profile &p) { p.lens_counts_per_s[LENS_IRIS] = 0; }},
        {"two-cameras-lens", "lens_backlash", [](rig_profile &p) { p.lens_backlash_counts = -1; }},
        {"two-cameras-lens", "lens_tolerance", [](rig_profile &p) { p.lens_tolerance_counts = 0; }},
    };
    for (const auto &test : cases) {
        rig_profile profile = named(test.base);
        test.corrupt(profile);
        rig_profile_error profile_error{};
        CHECK(rig_profile_check(&profile, &profile_error) != ERROR_OK);
        CHECK(std::string(profile_error.field) == test.field);
    }
}

// SPDX-License-Identifier: Apache-2.0
// The profiles that everybody has, and numbers that make no sense.
#include "rig/base/profile.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>

#include "core/error.h"
#include "device/lens_driver.h"

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
    CHECK(std::string(named("rig").lens_driver->name) == "v3lc");
    CHECK(!named("two-cameras").bridge);
    CHECK(named("two-cameras").lens_driver == nullptr);
    CHECK(!named("two-cameras-lens").bridge);
    CHECK(std::string(named("two-cameras-lens").lens_driver->name) == "v3lc");
}

TEST_CASE("each lens controller has consistent settings, and sides and axes that exist") {
    rig_profile profile = named("two-cameras");
    rig_profile_error profile_error{};
    size_t count = 0;
    const lens_driver *drivers = lens_drivers(&count);
    for (size_t i = 0; i < count; i++) {
        INFO(drivers[i].name);
        REQUIRE(rig_profile_set_lenses(&profile, drivers[i].name) == ERROR_OK);
        CHECK(profile.lens_driver == &drivers[i]);
        CHECK(rig_profile_check(&profile, &profile_error) == ERROR_OK);
        CHECK(rig_has_lens(&profile, RIG_LEFT));
        CHECK(rig_has_lens(&profile, RIG_RIGHT) == (drivers[i].lenses == 2));
        CHECK(!rig_has_lens(&profile, RIG_SIDES));
        CHECK(rig_has_axis(&profile, RIG_LEFT, LENS_ZOOM));
        CHECK(!rig_has_axis(&profile, RIG_LEFT, LENS_AXES));
        CHECK(rig_needs_lens_uart(&profile) == (drivers[i].port == LENS_PORT_UART));
        CHECK(rig_needs_i2c(&profile) == (drivers[i].port == LENS_PORT_I2C));
        for (int k = 0; k < LENS_AXES; k++) {
            const lens_axis_settings &axis = profile.lens.axis[k];
            if (!rig_has_axis(&profile, RIG_LEFT, lens_axis(k))) {
                continue;
            }
            const double travel_s = double(axis.max - axis.min) / axis.counts_per_s;
            CHECK(travel_s >= 2);
            CHECK(travel_s <= 20);
            CHECK(axis.backlash_counts * 40 <= axis.max - axis.min);
        }
    }
    CHECK(rig_profile_set_lenses(&profile, "v2lc") == ERROR_MISSING);
    REQUIRE(rig_profile_set_lenses(&profile, RIG_LENSES_FIXED) == ERROR_OK);
    CHECK(!rig_has_lens(&profile, RIG_LEFT));
    CHECK(profile.lens.axis[LENS_ZOOM].tolerance_counts == 0);
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
        {"two-cameras-lens", "lens_zoom_min", [](rig_profile &p) { p.lens.axis[0].min = 999; }},
        {"two-cameras-lens", "lens_zoom_max", [](rig_profile &p) { p.lens.axis[0].max = 1000; }},
        {"two-cameras-lens", "lens_focus_max", [](rig_profile &p) { p.lens.axis[1].max = 300; }},
        {"two-cameras-lens", "lens_iris_speed_min",
         [](rig_profile &p) { p.lens.axis[LENS_IRIS].counts_per_s = 0; }},
        {"two-cameras-lens", "lens_zoom_backlash",
         [](rig_profile &p) { p.lens.axis[0].backlash_counts = -1; }},
        {"two-cameras-lens", "lens_focus_tolerance",
         [](rig_profile &p) { p.lens.axis[1].tolerance_counts = 0; }},
        {"two-cameras-lens", "lens_iris_approach",
         [](rig_profile &p) { p.lens.axis[2].approach = 2; }},
        {"two-cameras-lens", "lens_baud", [](rig_profile &p) { p.lens.bits_per_s = 0; }},
    };
    for (const auto &test : cases) {
        rig_profile profile = named(test.base);
        test.corrupt(profile);
        rig_profile_error profile_error{};
        CHECK(rig_profile_check(&profile, &profile_error) != ERROR_OK);
        CHECK(std::string(profile_error.field) == test.field);
    }
}

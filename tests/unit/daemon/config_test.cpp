// SPDX-License-Identifier: Apache-2.0
// Profile files: a built-in profile survives printing and reading, each line changes its key, and
// the names and integers of older versions mean the same.
#include "daemon/settings/config.h"

#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "core/error.h"

namespace {

std::string printed(const char *name) {
    char *text = nullptr;
    size_t bytes = 0;
    FILE *file = open_memstream(&text, &bytes);
    message said{};
    REQUIRE(file != nullptr);
    REQUIRE(config_profile_print(file, name, &said) == ERROR_OK);
    std::fclose(file);
    const std::string all(text, bytes);
    std::free(text);
    return all;
}

// All keys of the instrument.
std::string reported(const config &settings) {
    std::string text;
    for (size_t i = 0; i < config_key_count(); i++) {
        char value[CONFIG_TEXT_BYTES + 16];
        config_key_print(&settings, i, value, sizeof value);
        if (config_key_is_of_rig(i)) {
            text += std::string(config_key_name(i)) + " = " + value + "\n";
        }
    }
    return text;
}

int parse(config &settings, const std::string &text) {
    message said{};
    return config_parse(&settings, "x.profile", text.data(), text.size(), &said);
}

}  // namespace

TEST_CASE("what is printed of a built-in profile is that profile") {
    for (const char *name : {"rig", "two-cameras", "two-cameras-lens"}) {
        config read, set;
        message said{};
        REQUIRE(parse(read, printed(name)) == ERROR_OK);
        config_defaults(&set);
        REQUIRE(config_set(&set, "profile", name, &said) == ERROR_OK);
        CHECK(reported(read) == reported(set));
        CHECK(std::string(read.like) == name);
        CHECK(std::string(read.profile_file) == "x.profile");
    }
}

TEST_CASE("each line of a profile counts") {
    // A profile with all parts, each number changed a little in both directions.
    const std::string all = printed("rig");
    config before;
    REQUIRE(parse(before, all) == ERROR_OK);
    unsigned changed = 0;
    for (size_t at = 0; at < all.size(); at = all.find('\n', at) + 1) {
        const std::string line = all.substr(at, all.find('\n', at) - at);
        const size_t equals = line.find(" = ");
        if (line.empty() || line[0] == '#' || equals == std::string::npos) {
            continue;
        }
        const std::string value = line.substr(equals + 3);
        const bool hex = value.compare(0, 2, "0x") == 0;
        char *end = nullptr;
        const double number =
            hex ? double(std::strtol(value.c_str(), &end, 16)) : std::strtod(value.c_str(), &end);
        if (end == value.c_str()) {
            continue;  // a word
        }
        for (const double other : {number - 2, number + 2}) {
            config after;
            char printed_other[32];
            std::snprintf(printed_other, sizeof printed_other, "%.4f", other);
            if (hex) {
                std::snprintf(printed_other, sizeof printed_other, "0x%x", unsigned(int(other)));
            }
            const std::string key = line.substr(0, equals);
            const std::string text = "like = rig\n" + key + " = " + printed_other + end + "\n";
            if (parse(after, text) != ERROR_OK) {
                continue;  // the key has no other value in this direction
            }
            CAPTURE(line);
            CHECK(reported(after) != reported(before));
            changed++;
        }
    }
    CHECK(changed >= 40);
}

TEST_CASE("names and integers of older versions mean the same") {
    // As printed by the version before units, with values of its own.
    static const struct {
        const char *old, *now;
    } lines[] = {
        {"bridge_address = 44", "bridge_address = 0x2c"},
        {"sensor_address_left = 93", "sensor_address_left = 0x5d"},
        {"sensor_address_right = 0x60", "sensor_address_right = 0x60"},
        {"sensor_clock_hz = 24000000", "sensor_clock = 24 MHz"},
        {"servo_left_centre_q4 = 24001", "servo_left_centre = 1500.0625 us"},
        {"servo_left_least_q4 = 9616", "servo_left_min = 601 us"},
        {"servo_left_most_q4 = 38384", "servo_left_max = 2399 us"},
        {"servo_left_q4_per_rad = 9500", "servo_left_scale = 10.363 us/deg"},
        {"servo_left_urad_per_s = 5000000", "servo_left_speed = 286.47889 deg/s"},
        {"servo_left_settle_us = 3300", "servo_left_settle = 3.3 ms"},
        {"servo_right_centre_q4 = 24000", "servo_right_centre = 1500 us"},
        {"servo_right_least_q4 = 9600", "servo_right_min = 600 us"},
        {"servo_right_most_q4 = 38400", "servo_right_max = 2400 us"},
        {"servo_right_q4_per_rad = 9442", "servo_right_scale = 10.3 us/deg"},
        {"servo_right_urad_per_s = 5500000", "servo_right_speed = 315.1268 deg/s"},
        {"servo_right_settle_us = 1", "servo_right_settle = 0.001 ms"},
        {"servo_slew_q4 = 481", "servo_slew = 30.0625 us"},
        {"watchdog_ms = 900", "servo_watchdog = 900 ms"},
        {"pan_least_urad = -500000", "pan_min = -28.64789 deg"},
        {"pan_most_urad = 400001", "pan_max = 22.91837 deg"},
        {"pan_repeatability_urad = 5000", "pan_repeatability = 0.28648 deg"},
        {"lenses = v1lc", "lenses = v1lc"},
        {"lens_counts_per_s_zoom = 21", "lens_zoom_speed_min = 21 counts/s"},
        {"lens_counts_per_s_focus = 22", "lens_focus_speed_min = 22 counts/s"},
        {"lens_counts_per_s_iris = 23", "lens_iris_speed_min = 23 counts/s"},
        {"lens_backlash_counts = 7", "lens_backlash = 7 counts"},
        {"lens_tolerance_counts = 8", "lens_tolerance = 8 counts"},
        {"lens_repeatability_counts = 9", "lens_repeatability = 9 counts"},
        {"lens_zoom_ppm = 4001", "lens_zoom_step = 0.4001 %"},
        {"width_px = 1024", "width = 1024 px"},
        {"height_px = 768", "height = 768 px"},
        {"frame_us = 1500", "frame_interval = 1.5 ms"},
        {"skew_limit_us = 2000000", "skew_limit = 2 s"},
        {"trigger_us = 250", "trigger_pulse = 0.25 ms"},
    };
    std::string old = "like = rig\nname = mine\n", now = old;
    for (const auto &line : lines) {
        old += std::string(line.old) + "\n";
        now += std::string(line.now) + "\n";
    }
    config read_old, read_now;
    REQUIRE(parse(read_old, old) == ERROR_OK);
    REQUIRE(parse(read_now, now) == ERROR_OK);
    CHECK(reported(read_old) == reported(read_now));
    CHECK(read_old.profile.pan_max_urad == 400001);
    CHECK(read_old.profile.servo[RIG_LEFT].q4_per_rad == 9500);
    CHECK(read_old.profile.skew_limit_us == 2000000);
    config settings;
    message said{};
    config_defaults(&settings);
    CHECK(config_set(&settings, "rig.pan_most_urad", "400001", &said) == ERROR_OK);
    CHECK(config_set(&settings, "rig.pan_most_urad", "22 deg", &said) == ERROR_SYNTAX);
    CHECK(config_set(&settings, "pan_most_urad", "400001", &said) == ERROR_ARGUMENT);
    CHECK(config_set(&settings, "rig.pan_max", "400001", &said) == ERROR_SYNTAX);
    CHECK(settings.profile.pan_max_urad == 400001);
}

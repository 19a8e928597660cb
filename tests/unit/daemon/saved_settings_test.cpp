// SPDX-License-Identifier: Apache-2.0
// Kept settings: their text, what of it an instrument takes, and the commands that set it so again.
#include "daemon/settings/saved_settings.h"

#include <doctest/doctest.h>

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "console/command.h"
#include "core/error.h"
#include "device/mt9t001.h"
#include "synthetic/seed.hpp"

namespace {

// A rig that is up, as far as this looks at it.
rig made(const char *profile) {
    rig made{};
    REQUIRE(rig_profile_named(profile, &made.profile) == ERROR_OK);
    made.state = RIG_READY;
    made.format = {640, 480};
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        made.camera[side].sensor.window = mt9t001_full_window();
        for (int axis = 0; axis < LENS_AXES; axis++) {
            made.camera[side].lens.commanded[axis] = INT32_MIN;
        }
    }
    return made;
}

std::string printed(const saved_settings &saved) {
    char text[SAVED_SETTINGS_BYTES];
    return std::string(text, saved_settings_print(&saved, text));
}

int parse(const std::string &text, saved_settings &saved) {
    message why{};
    return saved_settings_parse(text.data(), text.size(), &saved, &why);
}

std::vector<std::string> commands(const saved_settings &saved, const rig &rig) {
    char lines[SAVED_SETTINGS_LINES][SAVED_SETTINGS_LINE_BYTES];
    size_t of_cameras = 0;
    const size_t count = saved_settings_commands(&saved, &rig, lines, &of_cameras);
    return {lines, lines + count};
}

}  // namespace

TEST_CASE("what is in force, as text and back") {
    rig up = made("rig");
    for (rig_camera &camera : up.camera) {
        REQUIRE(mt9t001_centred_window(1024, 768, 2, 1, &camera.sensor.window) == ERROR_OK);
    }
    up.camera[RIG_LEFT].exposure_us = 7001;
    up.camera[RIG_RIGHT].gain_q3 = 20;
    up.camera[RIG_LEFT].pan_q4 = 24654;
    up.camera[RIG_RIGHT].lens.commanded[LENS_IRIS] = 400;
    saved_settings saved{}, read{};
    saved_settings_take(&up, &saved);
    const std::string text = printed(saved);
    CHECK(text ==
          "version = 4\nprofile = rig\nwindow = 1024 768 2\n[left]\nexposure = 7001 us\n"
          "pan = 3.9686 deg\n[right]\ngain = 2.5 x\niris = 400 counts\n");
    REQUIRE(parse(text, read) == ERROR_OK);
    CHECK(printed(read) == text);
    CHECK(commands(read, up) ==
          std::vector<std::string>{"exposure 7001 side=left", "gain 2.500 side=right",
                                   "pan 3.968592 side=left", "iris 400 side=right"});
    // The same in older versions.
    REQUIRE(parse("vergence settings 2\nprofile rig\nwindow 1024 768 2\nleft_exposure 7001 us\n"
                  "left_pan 3.9686 deg\nright_gain 2.5 x\nright_iris 400 counts\n",
                  read) == ERROR_OK);
    CHECK(printed(read) == text);
    REQUIRE(parse("vergence settings 1\nprofile rig\nwindow 1024 768 2\nleft_exposure_us 7001\n"
                  "left_pan_urad 69265\nright_gain_q3 20\nright_iris 400\n",
                  read) == ERROR_OK);
    CHECK(printed(read) == text);
}

TEST_CASE("windows that are not centred keep their place") {
    rig up = made("rig"), other = made("rig");
    for (rig_camera &camera : up.camera) {
        camera.sensor.window.width_px = 640;
        camera.sensor.window.height_px = 480;
    }
    up.camera[RIG_RIGHT].sensor.window.column_px = 1408;
    saved_settings saved{}, read{};
    saved_settings_take(&up, &saved);
    const std::string text = printed(saved);
    CHECK(text == "version = 4\nprofile = rig\nwindow = 640 480 1 0 0 1408 0\n[left]\n[right]\n");
    REQUIRE(parse(text, read) == ERROR_OK);
    CHECK(printed(read) == text);
    CHECK(commands(read, up).empty());
    CHECK(commands(read, other) ==
          std::vector<std::string>{"window 640 480 skip=1 column=0 row=0",
                                   "window 640 480 skip=1 column=1408 row=0 side=right"});
    message why{};
    CHECK(saved_settings_check(&read, &up, &why) == ERROR_OK);
    REQUIRE(parse("version = 3\nprofile = rig\nwindow = 640 480 1 0 0 1410 0\n", read) == ERROR_OK);
    CHECK(saved_settings_check(&read, &up, &why) == ERROR_RANGE);
    CHECK(parse("version = 3\nprofile = rig\nwindow = 640 480 1 0 0 8\n", read) == ERROR_SYNTAX);
}

TEST_CASE("what was learned about the lenses") {
    rig up = made("rig"), fresh = made("rig");
    lens_learned &left = up.camera[RIG_LEFT].lens.learned;
    for (int i = 0; i < LENS_POINTS_MAX; i++) {
        const lens_point point = {300 + 30 * i, i * 7 - 200, uint16_t(8 + i), uint16_t(i + 1)};
        lens_table_put(&left.focus, &point);
    }
    const lens_point ratio = {850, 1000, 1, 999};
    lens_table_put(&up.camera[RIG_RIGHT].lens.learned.iris, &ratio);
    up.object = {true, 8712, 10, false, 0, 0};
    saved_settings saved{}, read{};
    saved_settings_take(&up, &saved);
    const std::string text = printed(saved);
    CHECK(text.find("\nobject = 544.5:0.625\n") != std::string::npos);
    CHECK(text.find("\nzoom_to_focus = 300:-12.5:0.5:1\nzoom_to_focus = 330:-12.0625:0.5625:2\n") !=
          std::string::npos);
    CHECK(text.find("[right]\niris_to_f_number = 850:1:0.001:999\n") != std::string::npos);
    REQUIRE(parse(text, read) == ERROR_OK);
    CHECK(printed(read) == text);
    CHECK(read.lenses.learned[RIG_LEFT].focus.count == LENS_POINTS_MAX);
    // An instrument that has learned nothing gets all of it, one that has learned it nothing.
    const std::vector<std::string> lines = commands(read, fresh);
    REQUIRE(lines.size() == 3);
    CHECK(lines[0].find("lens learned side=left focus=300:-12.5:0.5:1,330:-12.0625:") == 0);
    CHECK(lines[1] == "lens learned side=right iris=850:1:0.001:999");
    CHECK(lines[2] == "lens learned object=544.5:0.625");
    size_t count = 0;
    const command *table = command_rig_table(&count), *found = nullptr;
    for (const std::string &line : lines) {
        char storage[COMMAND_LINE_MAX + 1], said[256] = "";
        command_value values[COMMAND_ARGUMENTS_MAX];
        REQUIRE(command_parse(line.c_str(), table, count, storage, values, &found, said,
                              sizeof said) == ERROR_OK);
        command_call call{};
        call.rig = &fresh;
        call.values = values;
        call.message = said;
        call.message_bytes = sizeof said;
        REQUIRE(command_run(found, &call) == ERROR_OK);
    }
    saved_settings_take(&fresh, &read);
    CHECK(printed(read) == text);
    // A bring-up does not replace what was learned since; "settings restore" does.
    fresh.camera[RIG_LEFT].lens.learned.focus.point[3].value++;
    char all[SAVED_SETTINGS_LINES][SAVED_SETTINGS_LINE_BYTES];
    size_t of_cameras = 0;
    CHECK(saved_settings_commands(&saved, &fresh, all, &of_cameras) == 2);
    CHECK(of_cameras == 0);
    // Not on an instrument without such a lens, and not in another form.
    rig single = made("rig");
    message why{};
    REQUIRE(rig_profile_set_lenses(&single.profile, "v1lc") == ERROR_OK);
    CHECK(saved_settings_check(&saved, &single, &why) == ERROR_NOT_CONNECTED);
    for (const char *line : {"object = 1", "object = 1:x", "[left]\nzoom_to_focus = 300:1:1",
                             "[left]\nzoom_to_focus = 300:1:1:1,400:1:1:1",
                             "[left]\nzoom_to_focus = 400:1:1:1\nzoom_to_focus = 300:1:1:1",
                             "zoom_to_focus = 300:1:1:1", "[left]\niris_to_f_number = 3:a:1:1",
                             "[left]\niris_to_f_number = 70000:1:1:1"}) {
        CAPTURE(line);
        CHECK(parse(std::string("version = 4\nprofile = rig\n") + line + "\n", read) ==
              ERROR_SYNTAX);
    }
    CHECK(parse("version = 3\nprofile = rig\nobject = 1:1\n", read) == ERROR_SYNTAX);
}

TEST_CASE("a value beyond its limits is saved as the limit") {
    rig up = made("rig");
    up.camera[RIG_LEFT].exposure_us = RIG_EXPOSURE_MAX_US + 1200;  // rounded to rows
    up.camera[RIG_RIGHT].pan_q4 = up.profile.servo[RIG_RIGHT].min_q4;
    saved_settings saved{};
    saved_settings_take(&up, &saved);
    CHECK(saved.values[RIG_LEFT][SAVED_EXPOSURE_US] == RIG_EXPOSURE_MAX_US);
    CHECK(saved.values[RIG_RIGHT][SAVED_PAN_URAD] == up.profile.pan_min_urad);
}

TEST_CASE("any other text is refused") {
    saved_settings saved{};
    const std::string first[] = {"vergence settings 1\nprofile x\n",
                                 "vergence settings 2\nprofile x\n", "version = 3\nprofile = x\n"};
    // Lines that only one of the versions has.
    const std::vector<const char *> lines[] = {
        {"left_exposure_us 7", "left_gain_q3 8", "left_pan_urad 9", "left_zoom 7"},
        {"left_exposure 7 us", "left_gain 1 x", "left_pan 9 deg", "left_zoom 7 counts"},
        {"[left]\nexposure = 7 us", "left.gain = 1 x", "[left]\npan = 9 deg",
         "[left]\nzoom = 7 counts"}};
    for (int version = 0; version < 3; version++) {
        for (int other = 0; other < 3; other++) {
            for (const char *line : lines[other]) {
                CAPTURE(line);
                CHECK(parse(first[version] + line + "\n", saved) ==
                      (version == other ? ERROR_OK : ERROR_SYNTAX));
            }
        }
    }
    for (const char *text :
         {"vergence settings 0\nprofile x\n", "vergence settings 3 \nprofile x\n",
          "vergence settings 4\nprofile x\n", "version = 5\nprofile = x\n",
          "version = x\nprofile = x\n"}) {
        CAPTURE(text);
        CHECK(parse(text, saved) != ERROR_OK);
    }
    CHECK(parse("version = 5\nprofile = x\n", saved) == ERROR_VERSION);
    for (const char *text : {"", "profile = x\n", "version = 3\n", "version = 3\nprofile = \n",
                             "vergence settings", "vergence settings\n", "settings 1\n"}) {
        CAPTURE(text);
        CHECK(parse(text, saved) != ERROR_OK);
    }
    for (const char *line :
         {"window = 8 480 1", "window = 640 480 9", "window = 640 480", "window = 640 480 1 1",
          "window = 640 480 -1", "left.exposure = 0 us", "left.exposure = 10000001 us",
          "left.gain = 0.875 x", "left.gain = 129 x", "left.gain = 2.3 x", "left.pan = 90.001 deg",
          "left.zoom = 65536 counts", "left.zoom = 7", "left.speed = 7", "up.zoom = 7 counts",
          "[left]\nzoom", "profile = abcdefghijklmnopqrstuvwxyz0123456", "zoom = 7 counts"}) {
        CAPTURE(line);
        CHECK(parse(first[2] + line + "\n", saved) == ERROR_SYNTAX);
    }
}

TEST_CASE("an instrument that cannot be set so takes none of it") {
    rig up = made("rig"), plain = made("two-cameras"), single = made("rig");
    REQUIRE(rig_profile_set_lenses(&single.profile, "v1lc") == ERROR_OK);
    saved_settings saved{};
    message why{};
    const auto checked = [&](rig &rig, const std::string &lines) {
        const std::string text =
            std::string("vergence settings 1\nprofile ") + rig.profile.name + "\n" + lines;
        REQUIRE(parse(text, saved) == ERROR_OK);
        why.text[0] = '\0';
        const int error = saved_settings_check(&saved, &rig, &why);
        CHECK((error == ERROR_OK) == (why.text[0] == '\0'));
        return error;
    };
    CHECK(checked(up, "window 2048 1536 1\nleft_pan_urad 523599\n") == ERROR_OK);
    CHECK(checked(up, "window 2050 1536 1\n") == ERROR_RANGE);
    CHECK(checked(up, "window 642 480 2\n") == ERROR_RANGE);
    CHECK(checked(up, "left_pan_urad 523600\n") == ERROR_RANGE);
    CHECK(checked(up, "right_zoom 850\n") == ERROR_OK);
    CHECK(checked(up, "right_zoom 851\n") == ERROR_RANGE);
    CHECK(checked(single, "left_zoom 100\n") == ERROR_OK);
    CHECK(checked(single, "left_iris 100\n") == ERROR_NOT_CONNECTED);
    CHECK(checked(single, "right_zoom 100\n") == ERROR_NOT_CONNECTED);
    CHECK(checked(plain, "window 4000 3000 1\nleft_exposure_us 9\n") == ERROR_OK);
    CHECK(checked(plain, "window 640 480 2\n") == ERROR_RANGE);
    CHECK(checked(plain, "right_pan_urad 0\n") == ERROR_NOT_CONNECTED);
    REQUIRE(parse("vergence settings 1\nprofile rig\n", saved) == ERROR_OK);
    CHECK(saved_settings_check(&saved, &plain, &why) == ERROR_ARGUMENT);
}

TEST_CASE("the commands are those of the table, and mean the same numbers again") {
    size_t count = 0;
    const command *table = command_rig_table(&count);
    const rig up = made("rig");
    std::mt19937_64 random(synthetic::test_seed());
    const auto draw = [&](int32_t min, int32_t max) {
        return std::uniform_int_distribution<int32_t>(min, max)(random);
    };
    for (int round = 0; round < 2000; round++) {
        saved_settings saved{};
        saved.width_px = 640;
        saved.height_px = 480;
        saved.skip = 1;
        for (auto &side : saved.values) {
            side[SAVED_EXPOSURE_US] = draw(1, RIG_EXPOSURE_MAX_US);
            side[SAVED_GAIN_Q3] = draw(8, 1024);
            side[SAVED_PAN_URAD] = draw(-1570796, 1570796);
            side[SAVED_ZOOM] = draw(0, 65535);
            side[SAVED_FOCUS] = draw(0, 1) != 0 ? INT32_MIN : draw(0, 65535);
            side[SAVED_IRIS] = 7;
        }
        for (const std::string &line : commands(saved, up)) {
            CAPTURE(line);
            char storage[COMMAND_LINE_MAX + 1], said[256];
            command_value values[COMMAND_ARGUMENTS_MAX];
            const command *found = nullptr;
            REQUIRE(command_parse(line.c_str(), table, count, storage, values, &found, said,
                                  sizeof said) == ERROR_OK);
            const unsigned side = values[1].choice == 1 ? RIG_RIGHT : RIG_LEFT;
            const std::string name = found->name;
            const auto &kept_of = saved.values[side];
            if (name == "gain") {
                CHECK(values[0].number * 8 == kept_of[SAVED_GAIN_Q3]);
            } else if (name == "exposure") {
                CHECK(values[0].integer == kept_of[SAVED_EXPOSURE_US]);
            } else if (name == "pan") {
                for (unsigned i = 0; i < RIG_SIDES; i++) {
                    const double urad = values[2 * i].number * 1e6 * 3.14159265358979323846 / 180;
                    CHECK(std::abs(urad - saved.values[i][SAVED_PAN_URAD]) < 0.1);
                }
            } else if (name == "zoom") {
                CHECK(values[0].integer == kept_of[SAVED_ZOOM]);
            }
        }
    }
}

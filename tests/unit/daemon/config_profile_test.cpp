// SPDX-License-Identifier: Apache-2.0
// A profile's file: what is printed of a built-in one is that one, and lines change one key each.
#include "daemon/settings/config_profile.h"

#include <doctest/doctest.h>

#include <cstdio>
#include <string>

#include "core/error.h"
#include "daemon/settings/config.h"

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
std::string told(const config &settings) {
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
    config_defaults(&settings);
    return config_profile_parse(&settings, "x.profile", text.data(), text.size(), &said);
}

}  // namespace

TEST_CASE("what is printed of a built-in profile is that profile") {
    for (const char *name : {"rig", "two-cameras", "two-cameras-lens"}) {
        config read, set;
        message said{};
        REQUIRE(parse(read, printed(name)) == ERROR_OK);
        config_defaults(&set);
        REQUIRE(config_set(&set, "profile", name, &said) == ERROR_OK);
        CHECK(told(read) == told(set));
        CHECK(std::string(read.like) == name);
        CHECK(std::string(read.profile_file) == "x.profile");
    }
}

TEST_CASE("each line of a profile counts") {
    // Of a profile with all parts: each number one further, the rest as it was.
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
        char *end = nullptr;
        const long number = std::strtol(line.c_str() + equals + 3, &end, 10);
        if (*end != '\0') {
            continue;  // a word
        }
        for (const long other : {number - 2, number + 2}) {
            config after;
            const std::string key = line.substr(0, equals);
            const std::string text = "like = rig\n" + key + " = " + std::to_string(other) + "\n";
            if (parse(after, text) != ERROR_OK) {
                continue;  // that one has no other value in this direction
            }
            CAPTURE(line);
            CHECK(told(after) != told(before));
            changed++;
        }
    }
    CHECK(changed >= 40);
}

TEST_CASE("the profile stays what its file says, and what changes it can be taken off") {
    config settings, other;
    message said{};
    REQUIRE(parse(settings, "like = two-cameras\nname = wide\nwidth_px = 1280\n") == ERROR_OK);
    REQUIRE(config_set(&settings, "rig.width_px", "320", &said) == ERROR_OK);
    config_defaults(&other);
    config_take_profile(&other, &settings);
    CHECK(other.profile.width_px == 1280);
    CHECK(std::string(other.profile.name) == "wide");
    CHECK(config_profile_is_file("a/b"));
    CHECK(config_profile_is_file("b.profile"));
    CHECK(!config_profile_is_file(".profile"));
    CHECK(!config_profile_is_file("rig"));
}

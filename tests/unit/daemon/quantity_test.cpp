// SPDX-License-Identifier: Apache-2.0
// Numbers with units: printing and reading undo each other, other units of the same kind mean the
// same, and everything else is rejected for the right reason.
#include "daemon/settings/quantity.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "synthetic/seed.hpp"

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int64_t kUnchanged = 12345678;

std::string printed(quantity kind, int64_t value) {
    char text[QUANTITY_BYTES];
    const size_t length = quantity_print(kind, value, text);
    CHECK(length == std::strlen(text));
    return text;
}

struct Read {
    int error;
    int64_t value;
    std::string why;
};

Read read(quantity kind, const std::string &text, int64_t min = -2000000, int64_t max = 60000000) {
    int64_t value = kUnchanged;
    message why{};
    const int error = quantity_parse(kind, text.c_str(), min, max, &value, &why);
    CHECK((error != 0) == (why.text[0] != '\0'));
    CHECK((error == 0 || value == kUnchanged));
    return {error, value, why.text};
}

int64_t good(quantity kind, const std::string &text) {
    const Read got = read(kind, text);
    CAPTURE(text);
    CHECK(got.error == ERROR_OK);
    return got.value;
}

}  // namespace

TEST_CASE("each integer prints as a number that reads as the same") {
    std::mt19937_64 random(synthetic::test_seed());
    std::uniform_int_distribution<int64_t> small(0, 5000), any(0, 2000000);
    for (int kind = 0; kind < QUANTITIES; kind++) {
        std::vector<int64_t> values = {0, 1, 2, 65535, 523599, 1570796, 2000000};
        for (int i = 0; i < 2000; i++) {
            values.push_back(i % 2 == 0 ? small(random) : any(random));
        }
        for (const int64_t value : values) {
            const std::string text = printed(quantity(kind), value);
            CAPTURE(text);
            REQUIRE(good(quantity(kind), text) == value);
            if (kind != QUANTITY_ADDRESS && value != 0) {
                REQUIRE(good(quantity(kind), printed(quantity(kind), -value)) == -value);
            }
        }
    }
    for (const int64_t value : {int64_t(INT32_MIN), int64_t(INT32_MAX)}) {
        CHECK(std::abs(std::atof(printed(QUANTITY_ANGLE, value).c_str()) -
                       double(value) * 180e-6 / kPi) < 0.001);
    }
}

TEST_CASE("numbers are as short as they can be") {
    CHECK(printed(QUANTITY_ANGLE, -523599) == "-30 deg");
    CHECK(printed(QUANTITY_ANGLE, 5236) == "0.3 deg");
    CHECK(printed(QUANTITY_ANGLE, 1570796) == "90 deg");
    CHECK(printed(QUANTITY_PULSE, 24000) == "1500 us");
    CHECK(printed(QUANTITY_PULSE, 24001) == "1500.0625 us");
    CHECK(printed(QUANTITY_SERVO_SCALE, 9442) == "10.3 us/deg");
    CHECK(printed(QUANTITY_TURN_RATE, 5500000) == "315.1268 deg/s");
    CHECK(printed(QUANTITY_MS_IN_US, 3300) == "3.3 ms");
    CHECK(printed(QUANTITY_PERCENT, 4187) == "0.4187 %");
    CHECK(printed(QUANTITY_GAIN, 20) == "2.5 x");
    CHECK(printed(QUANTITY_MM_IN_UM, 8500) == "8.5 mm");
    CHECK(printed(QUANTITY_UM_IN_NM, 3200) == "3.2 um");
    CHECK(printed(QUANTITY_F_NUMBER, 1600) == "1.6");
    CHECK(printed(QUANTITY_MHZ, 48000000) == "48 MHz");
    CHECK(printed(QUANTITY_ADDRESS, 0x2c) == "0x2c");
    CHECK(printed(QUANTITY_ADDRESS, 8) == "0x08");
    CHECK(printed(QUANTITY_NUMBER, -1) == "-1");
    char range[QUANTITY_RANGE_BYTES];
    quantity_print_range(QUANTITY_ANGLE, -1570796, 1570796, range);
    CHECK(std::string(range) == "-90 to 90 deg");
}

TEST_CASE("angles are rounded to the nearest integer") {
    for (double angle_deg = -90; angle_deg <= 90; angle_deg += 0.37) {
        char text[32];
        std::snprintf(text, sizeof text, "%.4f deg", angle_deg);
        const double exact_urad = std::atof(text) * kPi / 180e-6;
        CHECK(std::abs(double(good(QUANTITY_ANGLE, text)) - exact_urad) < 0.51);
    }
}

TEST_CASE("other units of the same kind") {
    for (const char *text : {"2 s", "2000 ms", "2000000 us", "2s", "2.000 s", "2 \t s"}) {
        CHECK(good(QUANTITY_MS_IN_US, text) == 2000000);
        CHECK(good(QUANTITY_US, text) == 2000000);
        CHECK(good(QUANTITY_MS, text) == 2000);
        CHECK(good(QUANTITY_S, text) == 2);
    }
    CHECK(good(QUANTITY_PULSE, "1.5 ms") == 24000);
    CHECK(good(QUANTITY_MS_IN_US, "1/50 s") == 20000);
    CHECK(good(QUANTITY_MM_IN_UM, "1.8 m") == 1800000);
    CHECK(good(QUANTITY_F_NUMBER, "f/8") == 8000);
    for (const char *text : {"24 MHz", "24000 kHz", "24000000 Hz"}) {
        CHECK(good(QUANTITY_MHZ, text) == 24000000);
    }
}

TEST_CASE("everything else is rejected for a reason") {
    const struct {
        quantity kind;
        const char *text;
        int error;
        const char *why;
    } cases[] = {
        {QUANTITY_ANGLE, "", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "deg", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "x deg", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "1e3 deg", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "1.1.1 deg", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "--1 deg", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "0x10 deg", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "1,5 deg", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "inf deg", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "2 deg/s", ERROR_SYNTAX, "unknown unit"},
        {QUANTITY_COUNTS, "2 s", ERROR_SYNTAX, "unknown unit"},
        {QUANTITY_MS, "2 MHz", ERROR_SYNTAX, "unknown unit"},
        {QUANTITY_MS, "2 S", ERROR_SYNTAX, "unknown unit"},
        {QUANTITY_MS, "2 s s", ERROR_SYNTAX, "not a number"},
        {QUANTITY_ANGLE, "30", ERROR_SYNTAX, "unit missing (expected deg)"},
        {QUANTITY_ANGLE, "30 ", ERROR_SYNTAX, "unit missing"},
        {QUANTITY_NUMBER, "30 s", ERROR_SYNTAX, "not an integer"},
        {QUANTITY_S, "0.5 s", ERROR_RANGE, "not a multiple of 1 s"},
        {QUANTITY_S, "3600.000001 s", ERROR_RANGE, "not a multiple of 1 s"},
        {QUANTITY_PULSE, "0.03 us", ERROR_RANGE, "not a multiple of 0.0625 us"},
        {QUANTITY_GAIN, "2.3 x", ERROR_RANGE, "not a multiple of 0.125 x"},
        {QUANTITY_F_NUMBER, "f/", ERROR_SYNTAX, "not a number"},
        {QUANTITY_F_NUMBER, "8 mm", ERROR_SYNTAX, "unknown unit"},
        {QUANTITY_F_NUMBER, "1.6001", ERROR_RANGE, "not a multiple of 0.001"},
    };
    for (const auto &one : cases) {
        const Read got = read(one.kind, one.text);
        CAPTURE(one.text);
        CHECK(got.error == one.error);
        CHECK(got.why.find(one.why) == 0);
    }
    CHECK(good(QUANTITY_NUMBER, "0x2c") == 44);
    CHECK(good(QUANTITY_ADDRESS, "0x2C") == 44);
    // However large.
    for (int digits = 1; digits < 400; digits += 7) {
        const std::string text = "9" + std::string(size_t(digits), '9') + ".999999 ";
        for (int kind = QUANTITY_PX; kind < QUANTITIES; kind++) {
            char step[QUANTITY_BYTES];
            quantity_print(quantity(kind), 0, step);
            const char *blank = std::strchr(step, ' ');
            const std::string unit = blank != nullptr ? blank : "";
            for (const char *sign : {"", "-"}) {
                CHECK(read(quantity(kind), sign + text + unit, -7, 7).error == ERROR_RANGE);
            }
        }
    }
    CHECK(read(QUANTITY_TURN_RATE, "5729.577961 deg/s", 0, 100000000).error == ERROR_OK);
    CHECK(read(QUANTITY_TURN_RATE, "5729.578961 deg/s", 0, 100000000).error == ERROR_RANGE);
}

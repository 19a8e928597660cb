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
    quantity_result result;
    int64_t value;
};

Read read(quantity kind, const std::string &text, int64_t min = -2000000, int64_t max = 60000000) {
    int64_t value = kUnchanged;
    const quantity_result result = quantity_parse(kind, text.c_str(), min, max, &value);
    return {result, value};
}

int64_t good(quantity kind, const std::string &text) {
    const Read got = read(kind, text);
    CAPTURE(text);
    CHECK(got.result == QUANTITY_GOOD);
    return got.value;
}

quantity_result bad(quantity kind, const std::string &text) {
    const Read got = read(kind, text);
    CHECK(got.value == kUnchanged);
    return got.result;
}

}  // namespace

TEST_CASE("each integer prints as a number that reads as the same") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    std::mt19937_64 random(seed);
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
    for (const char *text : {"24 MHz", "24000 kHz", "24000000 Hz"}) {
        CHECK(good(QUANTITY_MHZ, text) == 24000000);
    }
    for (const char *text : {"2 MHz", "2 deg", "2 S", "2 s s", "2 ms/s", "2 %"}) {
        CHECK(bad(QUANTITY_MS, text) == QUANTITY_UNIT_UNKNOWN);
    }
    CHECK(bad(QUANTITY_ANGLE, "2 deg/s") == QUANTITY_UNIT_UNKNOWN);
    CHECK(bad(QUANTITY_COUNTS, "2 s") == QUANTITY_UNIT_UNKNOWN);
}

TEST_CASE("everything else is rejected for a reason") {
    for (const char *text :
         {"", " ", "deg", "x deg", "1e3 deg", "+1 deg", ".5 deg", "1. deg", "01 deg", "1.1.1 deg",
          "--1 deg", "-0 deg", "0x10 deg", "1,5 deg", "0.1234567 deg", "inf deg"}) {
        CAPTURE(text);
        const quantity_result result = bad(QUANTITY_ANGLE, text);
        CHECK((result == QUANTITY_NOT_A_NUMBER || result == QUANTITY_UNIT_UNKNOWN));
    }
    CHECK(bad(QUANTITY_ANGLE, "30") == QUANTITY_UNIT_MISSING);
    CHECK(bad(QUANTITY_ANGLE, "30 ") == QUANTITY_UNIT_MISSING);
    CHECK(bad(QUANTITY_NUMBER, "30 s") == QUANTITY_NOT_A_NUMBER);
    CHECK(bad(QUANTITY_S, "0.5 s") == QUANTITY_NOT_A_STEP);
    CHECK(bad(QUANTITY_PULSE, "0.03 us") == QUANTITY_NOT_A_STEP);
    CHECK(bad(QUANTITY_GAIN, "2.3 x") == QUANTITY_NOT_A_STEP);
    CHECK(good(QUANTITY_NUMBER, "0x2c") == 44);
    CHECK(good(QUANTITY_ADDRESS, "0x2C") == 44);
    // However large.
    for (int digits = 1; digits < 40; digits++) {
        const std::string text = "9" + std::string(size_t(digits), '9') + ".999999 ";
        for (int kind = QUANTITY_PX; kind < QUANTITIES; kind++) {
            const std::string unit = quantity_unit(quantity(kind));
            for (const char *sign : {"", "-"}) {
                const quantity_result result =
                    read(quantity(kind), sign + text + unit, -7, 7).result;
                CHECK(result == QUANTITY_OUT_OF_RANGE);
            }
        }
    }
    CHECK(read(QUANTITY_S, "3600.000001 s", 0, 3600).result == QUANTITY_NOT_A_STEP);
    CHECK(read(QUANTITY_S, "3600000000.000001 us", 0, 3600).result == QUANTITY_NOT_A_STEP);
    CHECK(read(QUANTITY_TURN_RATE, "5729.577961 deg/s", 0, 100000000).result == QUANTITY_GOOD);
    CHECK(read(QUANTITY_TURN_RATE, "5729.578961 deg/s", 0, 100000000).result ==
          QUANTITY_OUT_OF_RANGE);
    CHECK(read(QUANTITY_SERVO_SCALE, "1090.900001 us/deg", 0, 1000000).result ==
          QUANTITY_OUT_OF_RANGE);
}

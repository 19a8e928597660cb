// SPDX-License-Identifier: Apache-2.0
#include "core/decimal.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>

#include "core/error.h"
#include "synthetic/seed.hpp"

namespace {

int parse(const std::string &text, int decimals, int64_t *scaled) {
    return decimal_parse(text.data(), text.size(), decimals, scaled);
}

std::string print(int64_t scaled, int decimals) {
    char text[DECIMAL_TEXT_BYTES];
    const size_t length = decimal_print(scaled, decimals, text);
    REQUIRE(text[length] == '\0');
    return std::string(text, length);
}

}  // namespace

TEST_CASE("decimals are spelled in one way") {
    CHECK(print(0, 0) == "0");
    CHECK(print(0, 3) == "0.000");
    CHECK(print(-5, 3) == "-0.005");
    CHECK(print(1234567, 3) == "1234.567");
    CHECK(print(-1230, 0) == "-1230");
    CHECK(print(DECIMAL_MAX, 0) == "1125899906842624");
    CHECK(print(-DECIMAL_MAX, 15) == "-1.125899906842624");
}

TEST_CASE("a double is printed to its nearest decimal, whatever its size") {
    const auto printed = [](double value, int decimals) {
        char text[DECIMAL_TEXT_BYTES];
        const size_t length = decimal_print_double(value, decimals, text);
        REQUIRE(text[length] == '\0');
        return std::string(text, length);
    };
    CHECK(printed(2.345678, 3) == "2.346");
    CHECK(printed(-0.0001, 3) == "0.000");
    CHECK(printed(1.25e12, 6) == "1250000000000.00");
    CHECK(printed(1795955000123456, 0) == "1795955000123456");
    CHECK(printed(9e18, 2) == "9000000000000000000");
    CHECK(printed(1e30, 2) == "inf");
    CHECK(printed(-HUGE_VAL, 0) == "-inf");
    CHECK(printed(std::nan(""), 4) == "nan");
    char least[DECIMAL_TEXT_BYTES];
    decimal_print_integer(std::numeric_limits<int64_t>::min(), least);
    CHECK(std::string(least) == "-9223372036854775808");
}

TEST_CASE("any other spelling is refused") {
    const char *const wrong[] = {"",       "-",      "+1.000", "1",      "1.00",    "1.0000",
                                 "01.000", "-0.000", ".000",   "1.",     "1,000",   "1.0e0",
                                 "0x1.00", "nan",    "inf",    "1.000 ", " 1.000",  "--1.000",
                                 "1-.000", "1.0.0",  "1.-00",  "00.000", "-01.000", "1 000"};
    for (const char *text : wrong) {
        int64_t scaled = 77;
        INFO("text '", std::string(text), "'");
        CHECK(parse(text, 3, &scaled) == ERROR_SYNTAX);
        CHECK(scaled == 77);
    }
    int64_t scaled = 77;
    CHECK(parse(std::string("1.0\0"
                            "0",
                            5),
                3, &scaled) == ERROR_SYNTAX);
    CHECK(parse("1125899906842625", 0, &scaled) == ERROR_RANGE);
    CHECK(parse(std::string(400, '9'), 0, &scaled) == ERROR_RANGE);
    CHECK(parse(std::string(400, '9') + ".x00", 3, &scaled) == ERROR_SYNTAX);
    CHECK(scaled == 77);
}

TEST_CASE("text, integer and double are the same number both ways") {
    std::mt19937_64 random(synthetic::test_seed());
    std::uniform_int_distribution<int> decimals_of(0, DECIMAL_MAX_DECIMALS);
    std::uniform_int_distribution<int> bits_of(1, 50);
    for (int i = 0; i < 500000; i++) {
        const int decimals = decimals_of(random);
        int64_t scaled = static_cast<int64_t>(random() >> (64 - bits_of(random)));
        scaled = i % 2 == 0 ? scaled : -scaled;
        if (i % 1000 == 0) {
            scaled = i % 2000 == 0 ? DECIMAL_MAX : -DECIMAL_MAX;
        }
        const double value = decimal_to_double(scaled, decimals);
        const std::string text = print(scaled, decimals);
        int64_t from_text = 0, from_double = 0;
        const bool same = parse(text, decimals, &from_text) == ERROR_OK && from_text == scaled &&
                          decimal_from_double(value, decimals, &from_double) == ERROR_OK &&
                          from_double == scaled;
        // The C library reads the same double: the quotient is correctly rounded.
        const bool library = std::strtod(text.c_str(), nullptr) == value;
        if (!same || !library) {
            INFO("text ", text, " decimals ", decimals);
            CHECK(same);
            CHECK(library);
        }
    }
}

TEST_CASE("doubles outside the range are refused") {
    int64_t scaled = 77;
    const double limit = static_cast<double>(DECIMAL_MAX);
    for (const double value :
         {std::nan(""), std::numeric_limits<double>::infinity(),
          -std::numeric_limits<double>::infinity(), 1e300, limit * 1.0000001, -limit * 1.0000001}) {
        CHECK(decimal_from_double(value, 0, &scaled) == ERROR_RANGE);
    }
    CHECK(decimal_from_double(limit / 1000, 4, &scaled) == ERROR_RANGE);
    CHECK(scaled == 77);
    CHECK(decimal_from_double(-0.0, 3, &scaled) == ERROR_OK);
    CHECK(scaled == 0);
    CHECK(decimal_from_double(0.0015, 3, &scaled) == ERROR_OK);
    CHECK(scaled == 2);
    CHECK(decimal_from_double(-0.0016, 3, &scaled) == ERROR_OK);
    CHECK(scaled == -2);
}

// SPDX-License-Identifier: Apache-2.0
#include "core/double/soft_double.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <random>

#include "synthetic/seed.hpp"

namespace {

uint64_t bits_of(double x) {
    uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    return std::isnan(x) ? 0x7ff8000000000000u : bits;
}

double double_of(uint64_t bits) {
    double x;
    std::memcpy(&x, &bits, sizeof x);
    return x;
}

// Numbers of all kinds: ends of ranges, subnormals, runs of ones, and exponents so near that sums
// cancel and round.
uint64_t draw(std::mt19937_64 &random) {
    static const double ends[] = {0,
                                  1,
                                  std::numeric_limits<double>::infinity(),
                                  std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::denorm_min(),
                                  std::numeric_limits<double>::min(),
                                  std::numeric_limits<double>::max()};
    const uint64_t sign = random() & 0x8000000000000000u, fraction = random() >> 12;
    switch (random() % 6) {
        case 0:
            return sign | (bits_of(ends[random() % std::size(ends)]) + random() % 3 - 1);
        case 1:
            return random();
        case 2:
            return sign | (1020 + random() % 7) << 52 | fraction;
        case 3:
            return sign | (1023 - 70 + random() % 140) << 52 | fraction;
        case 4:
            return sign | (random() % 2 * 2040 + random() % 7) << 52 | fraction;
        default:
            return sign | ((1020 + random() % 7) << 52 | 0xfffffffffffffu >> random() % 53);
    }
}

}  // namespace

TEST_CASE("sums, products, quotients and orders are those of the processor") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 300000; i++) {
        const uint64_t a = draw(random), b = i % 8 == 0 ? a ^ random() % 4 : draw(random);
        const double x = double_of(a), y = double_of(b);
        CAPTURE(a);
        CAPTURE(b);
        REQUIRE_EQ(soft_double_add(a, b), bits_of(x + y));
        REQUIRE_EQ(soft_double_subtract(a, b), bits_of(x - y));
        REQUIRE_EQ(soft_double_multiply(a, b), bits_of(x * y));
        REQUIRE_EQ(soft_double_divide(a, b), bits_of(x / y));
        const bool unordered = std::isnan(x) || std::isnan(y);
        const int order = x < y ? -1 : x > y ? 1 : 0;
        REQUIRE_EQ(soft_double_unordered(a, b), int{unordered});
        REQUIRE_EQ(soft_double_less(a, b), unordered ? 1 : order);
        REQUIRE_EQ(soft_double_greater(a, b), unordered ? -1 : order);
    }
}

TEST_CASE("conversions from and to integers are those of the processor") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 100000; i++) {
        const uint64_t whole = random() >> random() % 64;
        const auto negative = -static_cast<int64_t>(whole >> 1);
        CAPTURE(whole);
        REQUIRE_EQ(soft_double_from_uint64(whole), bits_of(static_cast<double>(whole)));
        REQUIRE_EQ(soft_double_from_int64(negative), bits_of(static_cast<double>(negative)));
        const double x = std::ldexp(static_cast<double>(whole), -static_cast<int>(random() % 64));
        if (x < 0x1p63) {
            REQUIRE_EQ(soft_double_magnitude(bits_of(x)), static_cast<uint64_t>(x));
            REQUIRE_EQ(soft_double_to_int64(bits_of(-x)), static_cast<int64_t>(-x));
        }
    }
}

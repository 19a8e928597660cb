// SPDX-License-Identifier: Apache-2.0
#include "core/double/reciprocal.h"

#include <doctest/doctest.h>

#include <initializer_list>
#include <random>

#include "synthetic/seed.hpp"

namespace {

void check_near(uint32_t divisor, uint64_t value) {
    const reciprocal made = reciprocal_of(divisor);
    for (int i = -2; i <= 2; i++) {
        const uint64_t near = value + static_cast<uint64_t>(i);
        if (near / divisor <= UINT32_MAX) {
            REQUIRE(reciprocal_quotient(near, &made) == near / divisor);
        }
    }
}

}  // namespace

TEST_CASE("quotients by a reciprocal are those of a division") {
    std::mt19937_64 random(synthetic::test_seed());
    for (uint32_t divisor = 1; divisor < 20000; divisor++) {
        for (const uint32_t d :
             {divisor, 0 - divisor, 0x80000000 + divisor, 0x80000000 - divisor}) {
            check_near(d, static_cast<uint64_t>(d) << 32);
            check_near(d, static_cast<uint64_t>(d) * static_cast<uint32_t>(random()));
        }
    }
    for (int i = 0; i < 1000000; i++) {
        const auto divisor = static_cast<uint32_t>(random() >> (32 + random() % 32)) | 1u;
        const uint64_t value = random() >> random() % 64;
        check_near(divisor, value);
        check_near(divisor, value % divisor << 32 | static_cast<uint32_t>(random()));
    }
}

TEST_CASE("scaled products are rounded down") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 1000000; i++) {
        const auto a = static_cast<int32_t>(random()), b = static_cast<int32_t>(random());
        const int bits = 32 + static_cast<int>(random() % 31);
        REQUIRE(product_scaled(a, b, bits) == (static_cast<int64_t>(a) * b) >> bits);
        REQUIRE(product_scaled(a >> 8, b >> 8, 17) ==
                (static_cast<int64_t>(a >> 8) * (b >> 8)) >> 17);
    }
}

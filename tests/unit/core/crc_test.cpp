// SPDX-License-Identifier: Apache-2.0
#include "core/crc.h"

#include <doctest/doctest.h>

#include <random>
#include <string>

#include "synthetic/seed.hpp"

TEST_CASE("the published check value of CRC-32") {
    CHECK(crc_update(0, "123456789", 9) == 0xcbf43926u);
}

TEST_CASE("nothing changes nothing") {
    CHECK(crc_update(0, nullptr, 0) == 0);
    CHECK(crc_update(0x12345678u, "", 0) == 0x12345678u);
}

TEST_CASE("any split gives the same sum, any flipped bit another one") {
    std::mt19937_64 random(synthetic::test_seed());
    std::string text(257, '\0');
    for (char &c : text) {
        c = static_cast<char>(random());
    }
    const uint32_t whole = crc_update(0, text.data(), text.size());
    for (size_t split = 0; split <= text.size(); split++) {
        const uint32_t first = crc_update(0, text.data(), split);
        REQUIRE(crc_update(first, text.data() + split, text.size() - split) == whole);
    }
    for (size_t bit = 0; bit < 8 * text.size(); bit++) {
        std::string flipped = text;
        flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
        REQUIRE(crc_update(0, flipped.data(), flipped.size()) != whole);
    }
}

// SPDX-License-Identifier: Apache-2.0
// What a log holds back.
#include "daemon/reply/flood.h"

#include <doctest/doctest.h>

#include <string>

namespace {

constexpr uint64_t minute_us = 60 * 1000000;

TEST_CASE("of a kind some are told at once, then one now and then, with the number of the others") {
    flood flood{};
    uint64_t held = 99;
    for (int i = 1; i < FLOOD_AT_ONCE; i++) {
        CHECK(flood_ask(&flood, ("zoom to " + std::to_string(i)).c_str(), 1, &held) == FLOOD_TELL);
        CHECK(held == 0);
    }
    CHECK(flood_ask(&flood, "zoom to 5000", 1, &held) == FLOOD_TELL_LAST);
    for (int i = 0; i < 100; i++) {
        CHECK(flood_ask(&flood, "zoom to 3", 9 * minute_us, &held) == FLOOD_HOLD);
    }
    CHECK(flood_ask(&flood, "zoom to 3", 11 * minute_us, &held) == FLOOD_TELL_LAST);
    CHECK(held == 100);
    CHECK(flood_ask(&flood, "zoom to 3", 11 * minute_us, &held) == FLOOD_HOLD);
    CHECK(flood_ask(&flood, "focus to 3", 11 * minute_us, &held) == FLOOD_TELL);
    CHECK(held == 0);
}

TEST_CASE("a kind that rested is told as a new one") {
    flood flood{};
    uint64_t held = 0;
    for (int i = 0; i < 2 * FLOOD_AT_ONCE; i++) {
        flood_ask(&flood, "a", 1, &held);
    }
    CHECK(flood_ask(&flood, "a", 600 * minute_us, &held) == FLOOD_TELL);
    CHECK(held == FLOOD_AT_ONCE);
    for (int i = 2; i < FLOOD_AT_ONCE; i++) {
        CHECK(flood_ask(&flood, "a", 600 * minute_us, &held) == FLOOD_TELL);
    }
    CHECK(flood_ask(&flood, "a", 600 * minute_us, &held) == FLOOD_TELL_LAST);
}

TEST_CASE("more kinds than there is room for: the one that was not seen for longest goes") {
    flood flood{};
    uint64_t held = 0;
    for (int i = 0; i <= FLOOD_AT_ONCE; i++) {
        flood_ask(&flood, "often", 1, &held);
    }
    for (int i = 0; i < FLOOD_KINDS - 1; i++) {
        CHECK(flood_ask(&flood, std::string(std::size_t(i) + 1, 'x').c_str(), 2, &held) ==
              FLOOD_TELL);
    }
    CHECK(flood_ask(&flood, "often", 3, &held) == FLOOD_HOLD);
    CHECK(flood_ask(&flood, "new", 4, &held) == FLOOD_TELL);
    CHECK(flood_ask(&flood, "often", 5, &held) == FLOOD_HOLD);
}

}  // namespace

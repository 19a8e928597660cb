// SPDX-License-Identifier: Apache-2.0
// What a log holds back.
#include "daemon/server/log_ratelimit.h"

#include <doctest/doctest.h>

#include <string>

namespace {

constexpr uint64_t minute_us = 60 * 1000000;

TEST_CASE("some of a kind are printed at once, then a few, with the number of those suppressed") {
    log_ratelimit log_ratelimit{};
    uint64_t held = 99;
    for (int i = 1; i < LOG_RATELIMIT_BURST; i++) {
        CHECK(log_ratelimit_check(&log_ratelimit, ("zoom to " + std::to_string(i)).c_str(), 1,
                                  &held) == LOG_RATELIMIT_PASS);
        CHECK(held == 0);
    }
    CHECK(log_ratelimit_check(&log_ratelimit, "zoom to 5000", 1, &held) == LOG_RATELIMIT_PASS_LAST);
    for (int i = 0; i < 100; i++) {
        CHECK(log_ratelimit_check(&log_ratelimit, "zoom to 3", 9 * minute_us, &held) ==
              LOG_RATELIMIT_DROP);
    }
    CHECK(log_ratelimit_check(&log_ratelimit, "zoom to 3", 11 * minute_us, &held) ==
          LOG_RATELIMIT_PASS_LAST);
    CHECK(held == 100);
    CHECK(log_ratelimit_check(&log_ratelimit, "zoom to 3", 11 * minute_us, &held) ==
          LOG_RATELIMIT_DROP);
    CHECK(log_ratelimit_check(&log_ratelimit, "focus to 3", 11 * minute_us, &held) ==
          LOG_RATELIMIT_PASS);
    CHECK(held == 0);
}

TEST_CASE("a kind that paused is printed as a new one") {
    log_ratelimit log_ratelimit{};
    uint64_t held = 0;
    for (int i = 0; i < 2 * LOG_RATELIMIT_BURST; i++) {
        log_ratelimit_check(&log_ratelimit, "a", 1, &held);
    }
    CHECK(log_ratelimit_check(&log_ratelimit, "a", 600 * minute_us, &held) == LOG_RATELIMIT_PASS);
    CHECK(held == LOG_RATELIMIT_BURST);
    for (int i = 2; i < LOG_RATELIMIT_BURST; i++) {
        CHECK(log_ratelimit_check(&log_ratelimit, "a", 600 * minute_us, &held) ==
              LOG_RATELIMIT_PASS);
    }
    CHECK(log_ratelimit_check(&log_ratelimit, "a", 600 * minute_us, &held) ==
          LOG_RATELIMIT_PASS_LAST);
}

TEST_CASE("more kinds than there is room for: the one that was not seen for longest goes") {
    log_ratelimit log_ratelimit{};
    uint64_t held = 0;
    for (int i = 0; i <= LOG_RATELIMIT_BURST; i++) {
        log_ratelimit_check(&log_ratelimit, "often", 1, &held);
    }
    for (int i = 0; i < LOG_RATELIMIT_KINDS - 1; i++) {
        CHECK(log_ratelimit_check(&log_ratelimit, std::string(std::size_t(i) + 1, 'x').c_str(), 2,
                                  &held) == LOG_RATELIMIT_PASS);
    }
    CHECK(log_ratelimit_check(&log_ratelimit, "often", 3, &held) == LOG_RATELIMIT_DROP);
    CHECK(log_ratelimit_check(&log_ratelimit, "new", 4, &held) == LOG_RATELIMIT_PASS);
    CHECK(log_ratelimit_check(&log_ratelimit, "often", 5, &held) == LOG_RATELIMIT_DROP);
}

}  // namespace

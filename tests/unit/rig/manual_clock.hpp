// SPDX-License-Identifier: Apache-2.0
/// A hal_clock for tests: time passes only where something waits.
#ifndef VERGENCE_TESTS_UNIT_RIG_MANUAL_CLOCK_HPP
#define VERGENCE_TESTS_UNIT_RIG_MANUAL_CLOCK_HPP

#include <cstdint>

#include "hal/clock.h"

struct Clock {
    uint64_t time_us = 1000000;
    static uint64_t now(void *self) { return static_cast<Clock *>(self)->time_us; }
    static void wait(void *self, uint64_t until_us) {
        uint64_t &time_us = static_cast<Clock *>(self)->time_us;
        time_us = until_us > time_us ? until_us : time_us;
    }
};

constexpr hal_clock_operations kClock = {Clock::now, Clock::wait, nullptr};

#endif

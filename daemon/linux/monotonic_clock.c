// SPDX-License-Identifier: Apache-2.0
#include "daemon/linux/monotonic_clock.h"

#include <errno.h>
#include <stddef.h>
#include <time.h>

#include "core/invariant.h"

enum { US_IN_S = 1000000, NS_IN_US = 1000 };

uint64_t monotonic_clock_now_us(void) {
    struct timespec now;
    const int failed = clock_gettime(CLOCK_MONOTONIC, &now);
    INVARIANT(failed == 0 && now.tv_sec >= 0);
    return (uint64_t)now.tv_sec * US_IN_S + (uint64_t)now.tv_nsec / NS_IN_US;
}

void monotonic_clock_wait_until_us(uint64_t time_us) {
    const struct timespec until = {.tv_sec = (time_t)(time_us / US_IN_S),
                                   .tv_nsec = (long)(time_us % US_IN_S) * NS_IN_US};
    while (monotonic_clock_now_us() < time_us) {
        const int error = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
        INVARIANT(error == 0 || error == EINTR);
    }
}

static uint64_t now_us(void *self) {
    (void)self;
    return monotonic_clock_now_us();
}

static void wait_until_us(void *self, uint64_t time_us) {
    (void)self;
    monotonic_clock_wait_until_us(time_us);
}

static const struct hal_clock_operations operations = {now_us, wait_until_us};
const struct hal_clock monotonic_clock = {&operations, NULL};

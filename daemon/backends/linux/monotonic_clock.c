// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/monotonic_clock.h"

#include <errno.h>
#include <stddef.h>
#include <time.h>

#include "core/invariant.h"
#include "daemon/base/monotonic.h"

void monotonic_clock_wait_until_us(uint64_t time_us) {
    const struct timespec until = monotonic_timespec(time_us);
    while (monotonic_now_us() < time_us) {
        const int error = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
        INVARIANT(error == 0 || error == EINTR);
    }
}

static uint64_t now_us(void *self) {
    (void)self;
    return monotonic_now_us();
}

static void wait_until_us(void *self, uint64_t time_us) {
    (void)self;
    monotonic_clock_wait_until_us(time_us);
}

static const struct hal_clock_operations operations = {now_us, wait_until_us, NULL};
const struct hal_clock monotonic_clock = {&operations, NULL};

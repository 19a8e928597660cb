// SPDX-License-Identifier: Apache-2.0
/// The system's monotonic clock, for all waits and durations of the daemon and the client. Code
/// that has a hal_clock uses that instead.
#ifndef VERGENCE_DAEMON_BASE_MONOTONIC_H
#define VERGENCE_DAEMON_BASE_MONOTONIC_H

#include <stdint.h>
#include <time.h>

#include "core/invariant.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { MONOTONIC_US_IN_S = 1000000, MONOTONIC_US_IN_MS = 1000, MONOTONIC_NS_IN_US = 1000 };

static inline uint64_t monotonic_now_us(void) {
    struct timespec now;
    const int failed = clock_gettime(CLOCK_MONOTONIC, &now);
    INVARIANT(failed == 0 && now.tv_sec >= 0);
    return (uint64_t)now.tv_sec * MONOTONIC_US_IN_S + (uint64_t)now.tv_nsec / MONOTONIC_NS_IN_US;
}

static inline int64_t monotonic_now_ms(void) {
    return (int64_t)(monotonic_now_us() / MONOTONIC_US_IN_MS);
}

/// A time of that clock as a struct timespec.
static inline struct timespec monotonic_timespec(uint64_t time_us) {
    struct timespec time;
    time.tv_sec = (time_t)(time_us / MONOTONIC_US_IN_S);
    time.tv_nsec = (long)(time_us % MONOTONIC_US_IN_S) * MONOTONIC_NS_IN_US;
    return time;
}

#ifdef __cplusplus
}
#endif

#endif

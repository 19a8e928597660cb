// SPDX-License-Identifier: Apache-2.0
/// The system's CLOCK_MONOTONIC as hal_clock: it never goes back and nobody sets it. All backends
/// of this folder mean it by their times, so they go with no other clock.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_MONOTONIC_CLOCK_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_MONOTONIC_CLOCK_H

#include "hal/clock.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The clock; it has no state, so all users share it. Static storage.
extern const struct hal_clock monotonic_clock;

/// Sleeps until `time_us`; signals do not cut it short.
void monotonic_clock_wait_until_us(uint64_t time_us);

#ifdef __cplusplus
}
#endif

#endif

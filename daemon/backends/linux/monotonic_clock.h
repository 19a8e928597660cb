// SPDX-License-Identifier: Apache-2.0
/// The system's CLOCK_MONOTONIC as hal_clock: it never goes back and cannot be set. All backends of
/// this folder use it for their times, so they require this clock.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_MONOTONIC_CLOCK_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_MONOTONIC_CLOCK_H

#include "hal/clock.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The clock. Stateless and shared by all users; static storage.
extern const struct hal_clock monotonic_clock;

/// Sleeps until `time_us`; signals do not end the sleep early.
void monotonic_clock_wait_until_us(uint64_t time_us);

#ifdef __cplusplus
}
#endif

#endif

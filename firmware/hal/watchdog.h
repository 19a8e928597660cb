// SPDX-License-Identifier: Apache-2.0
/// A watchdog that restarts the system when feeds stop.
#ifndef VERGENCE_HAL_WATCHDOG_H
#define VERGENCE_HAL_WATCHDOG_H

#include <stdint.h>

/// What a backend implements; `self` is that of `struct hal_watchdog`.
struct hal_watchdog_operations {
    /// Signals that the program is alive. Returns 0 or an error of the backend.
    int (*feed)(void *self);
    /// Longest time between two feeds, in us; 0: not active.
    uint64_t (*period_us)(void *self);
};

/// A watchdog. The backend owns what `self` points to, which must outlive all users.
struct hal_watchdog {
    const struct hal_watchdog_operations *operations;
    void *self;
};

#endif

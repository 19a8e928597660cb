// SPDX-License-Identifier: Apache-2.0
/// What restarts the system when nobody feeds it any more.
#ifndef VERGENCE_HAL_WATCHDOG_H
#define VERGENCE_HAL_WATCHDOG_H

#include <stdint.h>

/// What a backend implements; `self` is that of `struct hal_watchdog`.
struct hal_watchdog_operations {
    /// Shows that the program is alive. 0 or an error of the backend.
    int (*feed)(void *self);
    /// Longest time between two feeds, in us; 0: nobody watches.
    uint64_t (*period_us)(void *self);
};

/// A watchdog. The backend owns what `self` points to, which must outlive all users.
struct hal_watchdog {
    const struct hal_watchdog_operations *operations;
    void *self;
};

#endif

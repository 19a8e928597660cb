// SPDX-License-Identifier: Apache-2.0
/// The clock of all waits and deadlines. Simulations and replays provide their own, so that nothing
/// sleeps in real time there.
#ifndef VERGENCE_HAL_CLOCK_H
#define VERGENCE_HAL_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

/// What a backend implements; `self` is that of `struct hal_clock`.
struct hal_clock_operations {
    /// Microseconds since an arbitrary time; never decreases.
    uint64_t (*now_us)(void *self);
    /// Returns at `time_us` or later; at once if that time has passed.
    void (*wait_until_us)(void *self, uint64_t time_us);
    /// NULL: time passes, as in reality. Else, in virtual time: whether it has passed meanwhile, so
    /// that an idle instrument is to be serviced once (see rig_idle), then to be asked again.
    bool (*idle_is_due)(void *self);
};

/// A clock. The backend owns what `self` points to, which must outlive all users.
struct hal_clock {
    const struct hal_clock_operations *operations;
    void *self;
};

#endif

// SPDX-License-Identifier: Apache-2.0
/// A serial line: bytes in both directions, nothing about what they mean.
///
/// Backends return 0 or these of core/error.h: ERROR_TIMEOUT: the deadline passed; ERROR_DEVICE:
/// the line has gone (an adapter was unplugged); ERROR_IO: anything else that the system said.
#ifndef VERGENCE_HAL_UART_H
#define VERGENCE_HAL_UART_H

#include <stddef.h>
#include <stdint.h>

/// What a backend implements; `self` is that of `struct hal_uart`. Deadlines are of the system's
/// hal_clock.
struct hal_uart_operations {
    /// Sends all `bytes`; when it returns they are on their way in order, not yet sent for sure.
    int (*write)(void *self, const void *data, size_t bytes, uint64_t deadline_us);
    /// Waits for at least one byte and takes what is there, at most `capacity` (> 0).
    int (*read)(void *self, void *data, size_t capacity, uint64_t deadline_us, size_t *bytes);
    /// Forgets what has come and was not read.
    int (*discard)(void *self);
};

/// A line. The backend owns what `self` points to, which must outlive all users.
struct hal_uart {
    const struct hal_uart_operations *operations;
    void *self;
};

#endif

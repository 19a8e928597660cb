// SPDX-License-Identifier: Apache-2.0
/// A serial line: bytes in both directions, without interpretation.
///
/// Backends return 0 or these of core/error.h: ERROR_TIMEOUT: the deadline passed; ERROR_DEVICE:
/// the line is gone (an adapter was unplugged); ERROR_IO: any other error of the system.
#ifndef VERGENCE_HAL_UART_H
#define VERGENCE_HAL_UART_H

#include <stddef.h>
#include <stdint.h>

/// What a backend implements; `self` is that of `struct hal_uart`. Deadlines are on the system's
/// hal_clock.
struct hal_uart_operations {
    /// Queues all `bytes` in order; they may not have been sent yet when it returns.
    int (*write)(void *self, const void *data, size_t bytes, uint64_t deadline_us);
    /// Waits for at least one byte and returns what is available, at most `capacity` (> 0).
    int (*read)(void *self, void *data, size_t capacity, uint64_t deadline_us, size_t *bytes);
    /// Discards received bytes that were not read.
    int (*discard)(void *self);
};

/// A line. The backend owns what `self` points to, which must outlive all users.
struct hal_uart {
    const struct hal_uart_operations *operations;
    void *self;
};

#endif

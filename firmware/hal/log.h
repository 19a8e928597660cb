// SPDX-License-Identifier: Apache-2.0
/// Log messages that are not the answer to a command.
#ifndef VERGENCE_HAL_LOG_H
#define VERGENCE_HAL_LOG_H

/// Levels as in syslog.
enum hal_log_level {
    HAL_LOG_ERROR = 3,
    HAL_LOG_WARNING = 4,
    HAL_LOG_NOTICE = 5,
    HAL_LOG_INFO = 6,
    HAL_LOG_DEBUG = 7,
};

/// What a backend implements; `self` is that of `struct hal_log`.
struct hal_log_operations {
    /// Writes one line, without line end. Never blocks and cannot fail: lines may be lost; their
    /// number is reported with the next line.
    void (*write)(void *self, enum hal_log_level level, const char *text);
};

/// A log. The backend owns what `self` points to, which must outlive all users.
struct hal_log {
    const struct hal_log_operations *operations;
    void *self;
};

#endif

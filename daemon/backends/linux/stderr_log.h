// SPDX-License-Identifier: Apache-2.0
/// hal_log on standard error. On a terminal each line begins with its level as a word, elsewhere as
/// <4>, which journald reads.
///
/// A line that cannot be written at once (a pipe that is not read, a stopped terminal) is lost; the
/// next line that can be written is preceded by the number of lost lines.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_STDERR_LOG_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_STDERR_LOG_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/log.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The caller owns it; `hal` points to it, so it must not move.
struct stderr_log {
    struct hal_log hal;
    enum hal_log_level max;  ///< higher levels are not written; may be changed at any time
    int fd;                  ///< standard error, reopened non-blocking
    bool is_socket, is_terminal;
    uint32_t lost;
};

/// Never fails: without standard error all lines are lost. `max`: HAL_LOG_INFO, for example.
void stderr_log_open(struct stderr_log *self, enum hal_log_level max);
void stderr_log_close(struct stderr_log *self);

#ifdef __cplusplus
}
#endif

#endif

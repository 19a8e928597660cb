// SPDX-License-Identifier: Apache-2.0
/// hal_watchdog on Linux's /dev/watchdog: once opened, the system restarts if the watchdog is not
/// fed within the period, also after the program has crashed.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_WATCHDOG_DEV_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_WATCHDOG_DEV_H

#include <stdbool.h>

#include "daemon/base/message.h"
#include "hal/watchdog.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The caller owns it; `hal` points to it, so it must not move.
struct watchdog_dev {
    struct hal_watchdog hal;
    int fd;
    uint64_t period_us;  ///< 0: not reported by the driver
};

/// Opens and arms it. The period becomes the closest to `period_s` (1 .. 3600) that the driver
/// supports, or is unchanged if it cannot be set. ERROR_DEVICE (also: not a watchdog, and nothing
/// was written to it), ERROR_REFUSED (also: another program feeds it), ERROR_IO, with a message,
/// and nothing is open.
int watchdog_dev_open(struct watchdog_dev *self, const char *path, unsigned period_s,
                      struct message *message);

/// `orderly`: disarms it (magic close), unless the kernel was built with nowayout; otherwise it
/// stays armed and the system restarts after the period. Returns whether the disarm request was
/// written.
bool watchdog_dev_close(struct watchdog_dev *self, bool orderly);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// hal_watchdog on Linux's /dev/watchdog: from opening on, the system restarts when nobody feeds it
/// for the period, also when the program has crashed.
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
    uint64_t period_us;  ///< 0: the driver does not tell
};

/// Opens and arms it. The period becomes what the driver can do next to `period_s` (1 .. 3600), or
/// stays what it is where the driver cannot set it. ERROR_DEVICE (also: it is no watchdog, and
/// nothing was written to it), ERROR_REFUSED (also: another
/// program feeds it), ERROR_IO; `message` says more; nothing is open then.
int watchdog_dev_open(struct watchdog_dev *self, const char *path, unsigned period_s,
                      struct message *message);

/// `orderly`: disarms it (the magic close), unless the kernel was built so that it never stops;
/// else it stays armed and the system restarts after the period. Returns whether it was told to
/// disarm.
bool watchdog_dev_close(struct watchdog_dev *self, bool orderly);

#ifdef __cplusplus
}
#endif

#endif

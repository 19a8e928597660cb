// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/watchdog_dev.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/watchdog.h>
#include <string.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/device_file.h"

enum { PERIOD_MAX_S = 3600, US_IN_S = 1000000 };

static int feed(void *opaque) {
    const struct watchdog_dev *self = opaque;
    INVARIANT(self->fd >= 0);
    if (device_file_control(self->fd, WDIOC_KEEPALIVE, NULL) == 0) {
        return ERROR_OK;
    }
    if (errno != ENOTTY && errno != EOPNOTSUPP) {
        return device_file_error(errno);
    }
    // Any byte except 'V' feeds it; the kernel handles this for every driver.
    ssize_t written = 0;
    do {
        written = write(self->fd, "", 1);
    } while (written < 0 && errno == EINTR);
    if (written < 0) {
        return device_file_error(errno);
    }
    return written == 1 ? ERROR_OK : ERROR_IO;
}

static uint64_t period_us(void *opaque) {
    const struct watchdog_dev *self = opaque;
    return self->period_us;
}

/// Whether the device is a watchdog: every driver answers this request. Nothing may be written
/// before that is known.
static bool is_watchdog(const struct watchdog_dev *self) {
    struct watchdog_info information;
    return device_file_control(self->fd, WDIOC_GETSUPPORT, &information) == 0;
}

/// Sets the period as close to `period_s` as the driver can; returns the actual one, 0 if not
/// reported.
static bool set_period(struct watchdog_dev *self, int period_s) {
    int seconds = period_s;
    if (device_file_control(self->fd, WDIOC_SETTIMEOUT, &seconds) < 0) {
        if (errno != ENOTTY && errno != EOPNOTSUPP && errno != EINVAL) {
            return false;
        }
        if (device_file_control(self->fd, WDIOC_GETTIMEOUT, &seconds) < 0) {
            seconds = 0;
        }
    }
    self->period_us = seconds > 0 ? (uint64_t)seconds * US_IN_S : 0;
    return true;
}

int watchdog_dev_open(struct watchdog_dev *self, const char *path, unsigned period_s,
                      struct message *message) {
    static const struct hal_watchdog_operations operations = {feed, period_us};
    INVARIANT(period_s >= 1 && period_s <= PERIOD_MAX_S);
    *self = (struct watchdog_dev){.hal = {&operations, self}, .fd = -1};
    const int fd = device_file_open(path, O_WRONLY, "watchdog", message);
    if (fd < 0) {
        return fd;
    }
    self->fd = fd;
    if (!is_watchdog(self)) {
        const int error_number = errno;
        (void)watchdog_dev_close(self, false);
        return message_set(message, ERROR_DEVICE,
                           "watchdog %s: not a watchdog: %s (expected a device such as "
                           "/dev/watchdog)",
                           path, strerror(error_number));
    }
    if (!set_period(self, (int)period_s)) {
        const int error_number = errno;
        // Opening has armed it.
        (void)watchdog_dev_close(self, true);
        return message_set(message, device_file_error(error_number),
                           "watchdog %s: cannot set the period: %s", path, strerror(error_number));
    }
    return ERROR_OK;
}

bool watchdog_dev_close(struct watchdog_dev *self, bool orderly) {
    bool reported = false;
    if (self->fd >= 0 && orderly) {
        ssize_t written = 0;
        do {
            written = write(self->fd, "V", 1);
        } while (written < 0 && errno == EINTR);
        reported = written == 1;
    }
    device_file_close(&self->fd);
    return reported;
}

// SPDX-License-Identifier: Apache-2.0
/// What all backends do with a device's descriptor: open it with a message that helps, wait with a
/// deadline, and go on after a signal. Descriptors are never inherited by other programs.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_DEVICE_FILE_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_DEVICE_FILE_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Opens `path` (`flags` as for open; O_CLOEXEC and O_NOCTTY are added) and returns the
/// descriptor, or an error: ERROR_DEVICE: nothing is there, or no character device, which is not
/// opened then; ERROR_REFUSED: the user may not, or
/// another program has it; ERROR_IO: anything else. `what` names the device in `message`: "I2C
/// bus".
int device_file_open(const char *path, int flags, const char *what, struct message *message);

/// Closes `*fd` and makes it -1; harmless when it is that already.
void device_file_close(int *fd);

/// Whether `fd` is what stands under `path` now: a device that was pulled out and put back is
/// another file of the same name.
bool device_file_is_current(int fd, const char *path);

/// Which file stood under a path at some time.
struct device_file_identity {
    dev_t system, device;
    ino_t number;
};

/// What stands there now, for a device whose descriptor is a library's. False: nothing.
bool device_file_identify(const char *path, struct device_file_identity *identity);
bool device_file_is_same(const struct device_file_identity *a,
                         const struct device_file_identity *b);

/// ioctl, again when a signal cut it short. Returns its result, or -1 with errno.
/// Only for requests that may be made twice.
int device_file_control(int fd, unsigned long request, void *argument);

/// Waits for `events` of poll until `deadline_us` of monotonic_clock, in spite of signals.
/// 0, and in `*happened` what poll saw, errors included; ERROR_TIMEOUT; ERROR_IO.
int device_file_wait(int fd, short events, uint64_t deadline_us, short *happened);

/// The error of the list for an errno of a device that was open: ERROR_DEVICE when it is gone,
/// ERROR_TIMEOUT, else ERROR_IO.
int device_file_error(int error_number);

#ifdef __cplusplus
}
#endif

#endif

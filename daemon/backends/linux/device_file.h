// SPDX-License-Identifier: Apache-2.0
/// Common handling of device descriptors: open with a helpful message, wait with a deadline,
/// continue after a signal. Descriptors are never inherited by other programs.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_DEVICE_FILE_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_DEVICE_FILE_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Opens `path` (`flags` as for open; O_CLOEXEC and O_NOCTTY are added). Returns the descriptor, or
/// an error: ERROR_DEVICE: the file does not exist or is not a character device (which is then not
/// opened); ERROR_REFUSED: no permission, or in use by another program; ERROR_IO: anything else.
/// `what` names the device in `message`: "I2C bus".
int device_file_open(const char *path, int flags, const char *what, struct message *message);

/// Closes `*fd` and sets it to -1; harmless if it is -1.
void device_file_close(int *fd);

/// Whether `fd` is still the file at `path`: a device that was unplugged and plugged in again is
/// another file of the same name.
bool device_file_is_current(int fd, const char *path);

/// Identity of the file at a path at some time.
struct device_file_identity {
    dev_t system, device;
    ino_t number;
};

/// Identifies the current file at `path`, for devices whose descriptor a library owns. False: no
/// file.
bool device_file_identify(const char *path, struct device_file_identity *identity);
bool device_file_is_same(const struct device_file_identity *a,
                         const struct device_file_identity *b);

/// ioctl, repeated if a signal interrupts it; only for requests that may be repeated. Returns its
/// result, or -1 with errno.
int device_file_control(int fd, unsigned long request, void *argument);

/// Waits for poll() `events` until `deadline_us` of monotonic_clock; signals do not end the wait. 0
/// with poll's events in `*happened`, including errors; ERROR_TIMEOUT; ERROR_IO.
int device_file_wait(int fd, short events, uint64_t deadline_us, short *revents);

/// Maps an errno of an open device: ERROR_DEVICE if it has disappeared, ERROR_TIMEOUT, else
/// ERROR_IO.
int device_file_error(int error_number);

#ifdef __cplusplus
}
#endif

#endif

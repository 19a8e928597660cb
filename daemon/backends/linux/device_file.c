// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/device_file.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/monotonic_clock.h"
#include "daemon/base/device_request.h"
#include "daemon/base/monotonic.h"

// Longest single poll; longer waits repeat it.
static const uint64_t longest_poll_us = 3600 * UINT64_C(1000000);

static int open_error(int error_number, const char **advice) {
    switch (error_number) {
        case ENOENT:
        case ENODEV:
        case ENXIO:
            *advice = "check that it is connected and its driver is loaded";
            return ERROR_DEVICE;
        case EACCES:
        case EPERM:
            *advice = "the user must be in the group that owns it";
            return ERROR_REFUSED;
        case EBUSY:
            *advice = "in use by another program (end it first)";
            return ERROR_REFUSED;
        default:
            *advice = "see the kernel's messages (dmesg)";
            return ERROR_IO;
    }
}

int device_file_open(const char *path, int flags, const char *what, struct message *message) {
    struct stat status;
    int fd = -1;
    // Before opening: open() of a pipe would block, and regular files must not be changed.
    if (stat(path, &status) == 0 && !S_ISCHR(status.st_mode)) {
        return message_set(message, ERROR_DEVICE, "%s %s: not a character device", what, path);
    }
    do {
        fd = open(path, flags | O_CLOEXEC | O_NOCTTY);
    } while (fd < 0 && errno == EINTR);
    if (fd >= 0) {
        return fd;
    }
    const int error_number = errno;
    const char *advice = "";
    const int error = open_error(error_number, &advice);
    return message_set(message, error, "%s %s: %s; %s", what, path, strerror(error_number), advice);
}

void device_file_close(int *fd) {
    if (*fd >= 0) {
        // Linux closes the descriptor whatever close() returns, also after a signal.
        close(*fd);
        *fd = -1;
    }
}

static struct device_file_identity identity_of(const struct stat *status) {
    return (struct device_file_identity){
        .system = status->st_dev, .device = status->st_rdev, .number = status->st_ino};
}

bool device_file_identify(const char *path, struct device_file_identity *identity) {
    struct stat status;
    if (stat(path, &status) != 0) {
        return false;
    }
    *identity = identity_of(&status);
    return true;
}

bool device_file_is_same(const struct device_file_identity *a,
                         const struct device_file_identity *b) {
    return a->system == b->system && a->device == b->device && a->number == b->number;
}

bool device_file_is_current(int fd, const char *path) {
    struct stat status;
    struct device_file_identity there;
    if (fd < 0 || fstat(fd, &status) != 0 || !device_file_identify(path, &there)) {
        return false;
    }
    const struct device_file_identity ours = identity_of(&status);
    return device_file_is_same(&ours, &there);
}

int device_file_control(int fd, unsigned long request, void *argument) {
    INVARIANT(fd >= 0);
    int result = 0;
    do {
        result = ioctl(fd, (device_request)request, argument);
    } while (result < 0 && errno == EINTR);
    return result;
}

int device_file_wait(int fd, short events, uint64_t deadline_us, short *revents) {
    INVARIANT(fd >= 0 && events != 0);
    for (;;) {
        const uint64_t now_us = monotonic_now_us();
        uint64_t left_us = deadline_us > now_us ? deadline_us - now_us : 0;
        left_us = left_us < longest_poll_us ? left_us : longest_poll_us;
        const struct timespec timeout = {.tv_sec = (time_t)(left_us / 1000000),
                                         .tv_nsec = (long)(left_us % 1000000) * 1000};
        struct pollfd polled = {.fd = fd, .events = events};
        const int ready = ppoll(&polled, 1, &timeout, NULL);
        if (ready > 0) {
            *revents = polled.revents;
            return ERROR_OK;
        }
        if (ready < 0 && errno != EINTR) {
            return ERROR_IO;
        }
        // Poll at least once, even if the deadline has passed.
        if (monotonic_now_us() >= deadline_us) {
            return ERROR_TIMEOUT;
        }
    }
}

int device_file_error(int error_number) {
    switch (error_number) {
        case ENODEV:
        case ENXIO:
        case ESHUTDOWN:
        case EBADF:
            return ERROR_DEVICE;
        case ETIMEDOUT:
            return ERROR_TIMEOUT;
        default:
            return ERROR_IO;
    }
}

// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/write_all.h"

#include <errno.h>
#include <unistd.h>

bool write_all(int fd, const void *data, size_t bytes) {
    const char *next = data;
    while (bytes > 0) {
        const ssize_t written = write(fd, next, bytes);
        if (written > 0) {
            next += written;
            bytes -= (size_t)written;
        } else if (written == 0) {
            errno = EIO;
            return false;
        } else if (errno != EINTR) {
            return false;
        }
    }
    return true;
}

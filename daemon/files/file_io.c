// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/file_io.h"

#include <errno.h>
#include <fcntl.h>
#include <unistd.h>

#include "core/error.h"

bool file_error_is_full(int number) {
    return number == ENOSPC || number == EDQUOT || number == EFBIG;
}

int file_error(int number) {
    switch (number) {
        case ENOENT:
        case ENOTDIR:
            return ERROR_MISSING;
        case EACCES:
        case EPERM:
        case EROFS:
        case ELOOP:
            return ERROR_REFUSED;
        default:
            return file_error_is_full(number) ? ERROR_FULL : ERROR_IO;
    }
}

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

bool sync_file(int fd) {
    int result = 0;
    do {
        result = fsync(fd);
    } while (result != 0 && errno == EINTR);
    return result == 0 || errno == EINVAL || errno == ENOTSUP;
}

bool sync_directory_at(int directory, const char *path) {
    int fd = -1;
    do {
        fd = openat(directory, path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    } while (fd < 0 && errno == EINTR);
    if (fd < 0) {
        return false;
    }
    const bool synced = sync_file(fd);
    const int error_number = errno;
    close(fd);
    errno = error_number;
    return synced;
}

// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/sync_file.h"

#include <errno.h>
#include <fcntl.h>
#include <unistd.h>

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

// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/atomic_file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/files/file_io.h"

int atomic_file_begin(int directory, const char *temporary, mode_t mode) {
    int fd = -1;
    do {
        fd = openat(directory, temporary,
                    O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_NOCTTY | O_CLOEXEC, mode);
    } while (fd < 0 && errno == EINTR);
    return fd;
}

/// Syncs the directory that contains `name`. One that is writable but not readable cannot be.
static bool sync_name(int directory, const char *name) {
    char parent[PATH_MAX] = ".";
    const char *slash = strrchr(name, '/');
    if (slash == NULL && directory != AT_FDCWD && (fcntl(directory, F_GETFL) & O_PATH) == 0) {
        return sync_file(directory);
    }
    if (slash != NULL && snprintf(parent, sizeof parent, "%.*s/.", (int)(slash - name), name) >=
                             (int)sizeof parent) {
        errno = ENAMETOOLONG;
        return false;
    }
    return sync_directory_at(directory, parent) || errno == EACCES;
}

bool atomic_file_rename(int directory, int fd, const char *temporary, const char *name) {
    INVARIANT(fd >= 0 && strcmp(temporary, name) != 0);
    return sync_file(fd) && renameat(directory, temporary, directory, name) == 0 &&
           sync_name(directory, name);
}

bool atomic_file_end(int directory, int fd, const char *temporary, const char *name, bool written) {
    INVARIANT(fd >= 0 && strcmp(temporary, name) != 0);
    bool safe = written && sync_file(fd);
    int number = errno;
    // Linux always frees the descriptor.
    const bool closed = close(fd) == 0 || errno == EINTR;
    number = safe ? errno : number;
    safe = safe && closed;
    if (safe && renameat(directory, temporary, directory, name) == 0) {
        return sync_name(directory, name);
    }
    number = safe ? errno : number;
    unlinkat(directory, temporary, 0);
    errno = number;
    return false;
}

bool atomic_file_write(int directory, const char *temporary, const char *name, mode_t mode,
                       const void *data, size_t bytes) {
    const int fd = atomic_file_begin(directory, temporary, mode);
    return fd >= 0 && atomic_file_end(directory, fd, temporary, name, write_all(fd, data, bytes));
}

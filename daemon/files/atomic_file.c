// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/atomic_file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/files/file_io.h"

/// Opens the directory of `name`; `*base`: the name in it.
static int open_parent(int directory, const char *name, const char **base) {
    char parent[PATH_MAX] = ".";
    const char *slash = strrchr(name, '/');
    *base = slash == NULL ? name : slash + 1;
    if (slash != NULL && snprintf(parent, sizeof parent, "%.*s/.", (int)(slash - name), name) >=
                             (int)sizeof parent) {
        errno = ENAMETOOLONG;
        return -1;
    }
    return openat(directory, parent, O_PATH | O_DIRECTORY | O_CLOEXEC);
}

/// Creates a file under a temporary name that no other file has, and locks it. False with errno.
static bool create(struct atomic_file *self, mode_t mode) {
    const int flags = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_NOCTTY | O_CLOEXEC;
    for (int i = 0; i < OWN_NAMES; i++) {
        own_temporary_name(i, self->temporary);
        do {
            self->fd = openat(self->directory, self->temporary, flags, mode);
        } while (self->fd < 0 && errno == EINTR);
        if (self->fd >= 0) {
            flock(self->fd, LOCK_EX | LOCK_NB);
            return true;
        }
        if (errno != EEXIST) {
            break;
        }
    }
    return false;
}

static void close_directory(struct atomic_file *self) {
    if (self->opened) {
        close(self->directory);
    }
}

bool atomic_file_begin(struct atomic_file *self, int directory, const char *name, mode_t mode) {
    *self = (struct atomic_file){.fd = -1, .directory = directory, .name = name};
    self->opened = directory == AT_FDCWD || strchr(name, '/') != NULL;
    if (self->opened) {
        self->directory = open_parent(directory, name, &self->name);
    }
    if (self->opened && self->directory < 0) {
        return false;
    }
    if (!create(self, mode)) {
        const int number = errno;
        close_directory(self);
        errno = number;
        return false;
    }
    return true;
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

bool atomic_file_end(struct atomic_file *self, bool written) {
    INVARIANT(self->fd >= 0);
    bool safe = written && sync_file(self->fd);
    int number = errno;
    // Linux always frees the descriptor.
    const bool closed = close(self->fd) == 0 || errno == EINTR;
    number = safe ? errno : number;
    safe = safe && closed;
    if (safe && renameat(self->directory, self->temporary, self->directory, self->name) == 0) {
        safe = sync_name(self->directory, self->name);
        number = errno;
    } else {
        number = safe ? errno : number;
        safe = false;
        own_remove(self->directory, self->temporary, &(struct own_proof){.kind = OWN_TEMPORARY});
    }
    close_directory(self);
    self->fd = -1;
    errno = number;
    return safe;
}

bool atomic_file_write(int directory, const char *name, mode_t mode, const void *data,
                       size_t bytes) {
    struct atomic_file file;
    return atomic_file_begin(&file, directory, name, mode) &&
           atomic_file_end(&file, write_all(file.fd, data, bytes));
}

bool atomic_file_rename(int directory, int fd, const char *temporary, const char *name) {
    INVARIANT(fd >= 0 && strcmp(temporary, name) != 0);
    return sync_file(fd) && renameat(directory, temporary, directory, name) == 0 &&
           sync_name(directory, name);
}

// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/own_remove.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/files/directory_names.h"

enum { ABANDONED_AFTER_S = 60 };

void own_temporary_name(int number, char name[OWN_NAME_BYTES]) {
    snprintf(name, OWN_NAME_BYTES, OWN_PREFIX "%ld-%d", (long)getpid(), number);
}

/// The process id in a temporary name; -1: not one.
static long process_of(const char *name) {
    static const char digits[] = "0123456789";
    if (strncmp(name, OWN_PREFIX, strlen(OWN_PREFIX)) != 0) {
        return -1;
    }
    const char *process = name + strlen(OWN_PREFIX);
    const size_t length = strspn(process, digits);
    const char *number = process + length + 1;
    const bool good = length > 0 && length < 12 && process[length] == '-' && number[0] != '\0' &&
                      number[strspn(number, digits)] == '\0';
    return good ? strtol(process, NULL, 10) : -1;
}

/// Whether its process is gone: it is not locked, and not so new that another process may be about
/// to lock it.
static bool is_abandoned(int directory, const char *name, bool alone) {
    struct stat status;
    const int fd = openat(directory, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) {
        return false;
    }
    const bool abandoned = fstat(fd, &status) == 0 &&
                           (alone || time(NULL) - status.st_mtime > ABANDONED_AFTER_S) &&
                           flock(fd, LOCK_EX | LOCK_NB) == 0;
    close(fd);
    return abandoned;
}

static bool is_open_file(const struct stat *status, int fd) {
    struct stat mine;
    return fstat(fd, &mine) == 0 && mine.st_dev == status->st_dev && mine.st_ino == status->st_ino;
}

/// Whether this kind of file, under this form of name, can have such a proof.
static bool is_of_kind(const char *name, enum own_proof_kind kind, mode_t mode) {
    static const mode_t allowed[][2] = {
        [OWN_TEMPORARY] = {S_IFREG, S_IFDIR}, [OWN_ABANDONED] = {S_IFREG, S_IFDIR},
        [OWN_OPEN] = {S_IFREG, S_IFREG},      [OWN_LISTED] = {S_IFREG, S_IFREG},
        [OWN_ASKED] = {S_IFREG, S_IFLNK},     [OWN_EMPTY] = {S_IFDIR, S_IFDIR},
        [OWN_SOCKET] = {S_IFSOCK, S_IFSOCK}};
    const bool path = strchr(name, '/') != NULL;
    const bool may_be_path = kind == OWN_SOCKET || kind == OWN_OPEN || kind == OWN_EMPTY;
    const mode_t type = mode & S_IFMT;
    return name[0] != '\0' && (!path || may_be_path) &&
           (type == allowed[kind][0] || type == allowed[kind][1]);
}

static bool holds(int directory, const char *name, const struct own_proof *proof,
                  const struct stat *status) {
    if (!is_of_kind(name, proof->kind, status->st_mode)) {
        return false;
    }
    switch (proof->kind) {
        case OWN_TEMPORARY:
            return process_of(name) == getpid();
        case OWN_ABANDONED:
            return process_of(name) >= 0 && is_abandoned(directory, name, proof->alone);
        case OWN_OPEN:
            return is_open_file(status, proof->fd);
        case OWN_LISTED:
            return proof->lists(proof->listing, name);
        case OWN_ASKED:
        case OWN_EMPTY:
        case OWN_SOCKET:
            return true;
    }
    return false;
}

bool own_is_proven(int directory, const char *name, const struct own_proof *proof) {
    struct stat status;
    if (fstatat(directory, name, &status, AT_SYMLINK_NOFOLLOW) != 0) {
        return false;
    }
    errno = EPERM;
    return holds(directory, name, proof, &status);
}

/// Removes the files in a directory under a temporary name, which has no others. What another
/// program put there stays, and the directory with it.
static void empty_directory(int parent, const char *name) {
    DIR *stream =
        directory_stream(openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (stream == NULL) {
        return;
    }
    for (const struct dirent *entry; (entry = readdir(stream)) != NULL;) {
        struct stat status;
        if (fstatat(dirfd(stream), entry->d_name, &status, AT_SYMLINK_NOFOLLOW) == 0 &&
            S_ISREG(status.st_mode)) {
            unlinkat(dirfd(stream), entry->d_name, 0);
        }
    }
    closedir(stream);
}

bool own_remove(int directory, const char *name, const struct own_proof *proof) {
    struct stat status;
    if (fstatat(directory, name, &status, AT_SYMLINK_NOFOLLOW) != 0) {
        return false;
    }
    if (!holds(directory, name, proof, &status)) {
        errno = EPERM;
        return false;
    }
    if (S_ISDIR(status.st_mode)) {
        INVARIANT(proof->kind <= OWN_ABANDONED || proof->kind == OWN_EMPTY);
        if (proof->kind != OWN_EMPTY) {
            empty_directory(directory, name);
        }
        return unlinkat(directory, name, AT_REMOVEDIR) == 0;
    }
    return unlinkat(directory, name, 0) == 0;
}

int own_make_directory(int directory, char name[OWN_NAME_BYTES]) {
    for (int i = 0; i < OWN_NAMES; i++) {
        own_temporary_name(i, name);
        // With mkdir: the kernel applies the umask, which cannot be read without changing it for
        // all threads.
        if (mkdirat(directory, name, 0777) == 0) {
            const int fd = openat(directory, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
            if (fd >= 0) {
                flock(fd, LOCK_EX | LOCK_NB);
            }
            return fd;
        }
        if (errno != EEXIST) {
            break;
        }
    }
    return -1;
}

void own_remove_abandoned(int directory, bool alone) {
    const struct own_proof proof = {.kind = OWN_ABANDONED, .alone = alone};
    DIR *stream = directory_stream(openat(directory, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (stream == NULL) {
        return;
    }
    for (const struct dirent *entry; (entry = readdir(stream)) != NULL;) {
        if (process_of(entry->d_name) >= 0) {
            own_remove(directory, entry->d_name, &proof);
        }
    }
    closedir(stream);
}

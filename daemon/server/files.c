// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/files.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/server/surroundings.h"
#include "daemon/write_all.h"

static int error_of(int number) {
    switch (number) {
        case ENOENT:
        case ENOTDIR:
            return ERROR_MISSING;
        case ENOSPC:
        case EDQUOT:
            return ERROR_FULL;
        case EACCES:
        case EPERM:
        case EROFS:
        case ELOOP:
            return ERROR_REFUSED;
        default:
            return ERROR_IO;
    }
}

static int refuse_system(const struct command_call *call, const char *name, int number) {
    return surroundings_refuse(call, error_of(number), "%s: %s", name, strerror(number));
}

/// Goes down one directory after the other, so that no link on the way is followed.
static int open_below(int root, const char *name, int flags) {
    int directory = openat(root, ".", O_PATH | O_DIRECTORY | O_CLOEXEC);
    while (directory >= 0) {
        const size_t bytes = strcspn(name, "/");
        char part[FILES_NAME_MAX + 1];
        if (bytes == 0 || bytes > FILES_NAME_MAX || name[0] == '.') {
            close(directory);
            errno = ENOENT;
            return -1;
        }
        memcpy(part, name, bytes);
        part[bytes] = '\0';
        const bool last = name[bytes] == '\0';
        const int next =
            openat(directory, part, O_NOFOLLOW | O_CLOEXEC | (last ? flags : O_PATH | O_DIRECTORY));
        const int number = errno;
        close(directory);
        errno = number;
        if (last || next < 0) {
            return next;
        }
        directory = next;
        name += bytes + 1;
    }
    return -1;
}

static int need_directory(const struct command_call *call) {
    if (surroundings_of(call)->files_fd >= 0) {
        return 0;
    }
    return surroundings_refuse(call, ERROR_UNSUPPORTED,
                               "there are no files: the setting \"files\" is none");
}

int files_open(const struct command_call *call, const char *name) {
    const int error = need_directory(call);
    if (error != 0) {
        return error;
    }
    // Not blocking: a named pipe must not hold up anybody.
    const int fd = open_below(surroundings_of(call)->files_fd, name, O_RDONLY | O_NONBLOCK);
    struct stat about;
    if (fd < 0) {
        return refuse_system(call, name, errno);
    }
    if (fstat(fd, &about) != 0 || !S_ISREG(about.st_mode)) {
        close(fd);
        return surroundings_refuse(call, ERROR_ARGUMENT, "%s: is no file", name);
    }
    return fd;
}

int files_open_directory(const struct command_call *call, const char *name) {
    const int error = need_directory(call);
    if (error != 0) {
        return error;
    }
    const int root = surroundings_of(call)->files_fd;
    const int fd = name[0] == '\0' ? openat(root, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC)
                                   : open_below(root, name, O_RDONLY | O_DIRECTORY);
    return fd >= 0 ? fd : refuse_system(call, name[0] == '\0' ? "files" : name, errno);
}

int files_write(const struct command_call *call, const char *name, const void *data, size_t bytes) {
    const int error = need_directory(call);
    INVARIANT(strchr(name, '/') == NULL && strlen(name) <= FILES_NAME_MAX);
    if (error != 0) {
        return error;
    }
    const int root = surroundings_of(call)->files_fd;
    char part[FILES_NAME_MAX + 8];
    snprintf(part, sizeof part, ".%s.part", name);
    const int fd = openat(root, part, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0640);
    if (fd < 0) {
        return refuse_system(call, name, errno);
    }
    const bool written = write_all(fd, data, bytes) && fsync(fd) == 0;
    int number = errno;
    const bool closed = close(fd) == 0;
    if (written && closed && renameat(root, part, root, name) == 0) {
        return 0;
    }
    number = written ? errno : number;
    unlinkat(root, part, 0);
    return refuse_system(call, name, number);
}

void files_base64(const void *data, size_t bytes, char *text) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const uint8_t *from = data;
    for (size_t i = 0; i < bytes; i += 3) {
        const size_t left = bytes - i;
        const uint32_t three = (uint32_t)from[i] << 16 |
                               (left > 1 ? (uint32_t)from[i + 1] << 8 : 0) |
                               (left > 2 ? (uint32_t)from[i + 2] : 0);
        *text++ = digits[three >> 18];
        *text++ = digits[three >> 12 & 63];
        *text++ = left > 1 ? digits[three >> 6 & 63] : '=';
        *text++ = left > 2 ? digits[three & 63] : '=';
    }
    *text = '\0';
}

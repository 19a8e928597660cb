// SPDX-License-Identifier: Apache-2.0
// C library functions that query a path: how libgpiod identifies a device.
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "fake_file.h"

char *__realpath_chk(const char *path, char *resolved, size_t room);

#define NEXT(type, name)                          \
    static type next;                             \
    if (next == NULL) {                           \
        *(void **)&next = dlsym(RTLD_NEXT, name); \
        if (next == NULL) {                       \
            abort();                              \
        }                                         \
    }

static void describe_device(const struct fake_device *device, struct stat *status) {
    memset(status, 0, sizeof *status);
    status->st_mode = S_IFCHR | 0660;
    status->st_rdev = makedev(device->major, device->minor);
    status->st_ino = fake_file_plugged(device);
}

/// stat() of a device's path: 0, or -1 with errno.
static int look_at(const struct fake_device *device, struct stat *status) {
    if (fake_file_plugged(device) == 0) {
        errno = ENOENT;
        return -1;
    }
    describe_device(device, status);
    return 0;
}

int stat(const char *path, struct stat *status) {
    typedef int (*function)(const char *, struct stat *);
    const struct fake_device *device = fake_file_device_at(path);
    if (device != NULL) {
        return look_at(device, status);
    }
    NEXT(function, "stat")
    return next(path, status);
}

int lstat(const char *path, struct stat *status) {
    typedef int (*function)(const char *, struct stat *);
    const struct fake_device *device = fake_file_device_at(path);
    if (device != NULL) {
        return look_at(device, status);
    }
    NEXT(function, "lstat")
    return next(path, status);
}

int fstat(int fd, struct stat *status) {
    typedef int (*function)(int, struct stat *);
    const struct fake_file *file = fake_file_of(fd);
    if (file != NULL && file->device != NULL) {
        describe_device(file->device, status);
        status->st_ino = file->plugged;
        return 0;
    }
    NEXT(function, "fstat")
    return next(fd, status);
}

int access(const char *path, int mode) {
    typedef int (*function)(const char *, int);
    struct stat status;
    const struct fake_device *device = fake_file_device_at(path);
    if (device != NULL) {
        return look_at(device, &status);
    }
    NEXT(function, "access")
    return next(path, mode);
}

/// The /sys subsystem of a fake chip, or NULL for other paths.
static char *resolve_subsystem(const char *path, char *resolved) {
    static const char bus[] = "/sys/bus/gpio";
    if (strcmp(path, "/sys/dev/char/254:0/subsystem") != 0) {
        return NULL;
    }
    if (resolved == NULL) {
        return strdup(bus);
    }
    memcpy(resolved, bus, sizeof bus);
    return resolved;
}

char *realpath(const char *path, char *resolved) {
    typedef char *(*function)(const char *, char *);
    char *ours = resolve_subsystem(path, resolved);
    if (ours != NULL) {
        return ours;
    }
    NEXT(function, "realpath")
    return next(path, resolved);
}

char *__realpath_chk(const char *path, char *resolved, size_t room) {
    typedef char *(*function)(const char *, char *, size_t);
    char *ours = resolve_subsystem(path, resolved);
    if (ours != NULL) {
        return ours;
    }
    NEXT(function, "__realpath_chk")
    return next(path, resolved, room);
}

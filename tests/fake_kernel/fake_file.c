// SPDX-License-Identifier: Apache-2.0
#include "fake_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static struct fake_device devices[FAKE_DEVICES];
static struct fake_file files[FAKE_FILES];
static int reserve_fd = -1;  // descriptor of files that belong to no device

struct fake_device *fake_file_device(const char *path, unsigned major, unsigned minor,
                                     const struct fake_operations *operations, void *state) {
    for (int i = 0; i < FAKE_DEVICES; i++) {
        if (devices[i].operations == NULL) {
            devices[i] = (struct fake_device){.major = major,
                                              .minor = minor,
                                              .operations = operations,
                                              .state = state,
                                              .memory_fd = -1};
            snprintf(devices[i].path, sizeof devices[i].path, "%s", path);
            return &devices[i];
        }
    }
    fprintf(stderr, "fake kernel: no room for another device\n");
    abort();
}

struct fake_device *fake_file_device_at(const char *path) {
    for (int i = 0; i < FAKE_DEVICES; i++) {
        if (devices[i].operations != NULL && strcmp(devices[i].path, path) == 0) {
            return &devices[i];
        }
    }
    return NULL;
}

void fake_file_forget_all(void) {
    memset(devices, 0, sizeof devices);
    memset(files, 0, sizeof files);
}

void fake_file_prepare(void) {
    for (int i = 0; i < FAKE_DEVICES; i++) {
        if (devices[i].operations != NULL) {
            devices[i].memory_fd = (int)syscall(SYS_memfd_create, "fake", MFD_CLOEXEC);
        }
    }
    reserve_fd = (int)syscall(SYS_memfd_create, "fake", MFD_CLOEXEC);
}

uint64_t fake_file_plugged(const struct fake_device *device) {
    if (device->plug[0] == '\0') {
        return 1;
    }
    struct stat status;
    if (stat(device->plug, &status) != 0) {
        return 0;
    }
    // Inode numbers are reused; times are not.
    const uint64_t time_ns =
        (uint64_t)status.st_ctim.tv_sec * 1000000000 + (uint64_t)status.st_ctim.tv_nsec;
    return (status.st_ino ^ time_ns) | 1;
}

bool fake_file_is_dead(struct fake_file *file) {
    file->dead =
        file->dead || (file->device != NULL && fake_file_plugged(file->device) != file->plugged);
    return file->dead;
}

struct fake_file *fake_file_of(int fd) {
    return fd >= 0 && fd < FAKE_FILES && files[fd].known ? &files[fd] : NULL;
}

static void remember(int fd, const char *name, struct fake_device *device,
                     const struct fake_operations *operations, void *state) {
    if (fd >= FAKE_FILES) {
        fprintf(stderr, "fake kernel: descriptor %d is too high\n", fd);
        abort();
    }
    files[fd] = (struct fake_file){.known = true,
                                   .fd = fd,
                                   .device = device,
                                   .operations = operations,
                                   .state = state,
                                   .plugged = device == NULL ? 0 : fake_file_plugged(device)};
    snprintf(files[fd].name, sizeof files[fd].name, "%s", name);
}

int fake_file_new(const char *name, struct fake_device *device,
                  const struct fake_operations *operations, void *state) {
    const int memory_fd = device == NULL ? reserve_fd : device->memory_fd;
    const int fd = memory_fd < 0 ? (int)syscall(SYS_memfd_create, "fake", MFD_CLOEXEC)
                                 : (int)syscall(SYS_fcntl, memory_fd, F_DUPFD_CLOEXEC, 0);
    if (fd < 0) {
        return -errno;
    }
    remember(fd, name, device, operations, state);
    return fd;
}

void fake_file_adopt(int fd, const char *name) {
    remember(fd, name, NULL, NULL, NULL);
}

void fake_file_drop(int fd) {
    files[fd].known = false;
}

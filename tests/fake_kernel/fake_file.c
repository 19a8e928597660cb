// SPDX-License-Identifier: Apache-2.0
#include "fake_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

static struct fake_device devices[FAKE_DEVICES];
static struct fake_file files[FAKE_FILES];

struct fake_device *fake_file_device(const char *path, unsigned major, unsigned minor,
                                     const struct fake_operations *operations, void *state) {
    for (int i = 0; i < FAKE_DEVICES; i++) {
        if (devices[i].operations == NULL) {
            devices[i] = (struct fake_device){
                .major = major, .minor = minor, .operations = operations, .state = state};
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

struct fake_file *fake_file_of(int fd) {
    return fd >= 0 && fd < FAKE_FILES && files[fd].known ? &files[fd] : NULL;
}

static void remember(int fd, const char *name, struct fake_device *device,
                     const struct fake_operations *operations, void *state) {
    if (fd >= FAKE_FILES) {
        fprintf(stderr, "fake kernel: descriptor %d is too high\n", fd);
        abort();
    }
    files[fd] = (struct fake_file){
        .known = true, .fd = fd, .device = device, .operations = operations, .state = state};
    snprintf(files[fd].name, sizeof files[fd].name, "%s", name);
}

int fake_file_new(const char *name, struct fake_device *device,
                  const struct fake_operations *operations, void *state) {
    const int fd = (int)syscall(SYS_memfd_create, "fake", MFD_CLOEXEC);
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

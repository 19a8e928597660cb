// SPDX-License-Identifier: Apache-2.0
/// Internal interface of the fake kernel: devices, open files, and the record.
#ifndef VERGENCE_TESTS_FAKE_FILE_H
#define VERGENCE_TESTS_FAKE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

enum { FAKE_FILES = 1024, FAKE_DEVICES = 8, FAKE_PATH_BYTES = 512, FAKE_LINE_BYTES = 1024 };

struct fake_file;

/// Operations of a device. They return >= 0 or -errno; NULL ones give ENOTTY (ioctl) or EINVAL.
struct fake_operations {
    int (*open)(struct fake_file *file);
    void (*close)(struct fake_file *file);
    /// Writes the request and its argument, as before the call, into `line`.
    void (*describe)(struct fake_file *file, unsigned long request, const void *argument,
                     char *line, size_t bytes);
    int (*ioctl)(struct fake_file *file, unsigned long request, void *argument);
    int (*read)(struct fake_file *file, void *data, size_t bytes);
    int (*write)(struct fake_file *file, const void *data, size_t bytes);
    /// The same at an offset.
    int (*pread)(struct fake_file *file, void *data, size_t bytes, off_t offset);
    int (*pwrite)(struct fake_file *file, const void *data, size_t bytes, off_t offset);
    /// The poll() events at `now_us`. `*next_us`: when to poll again at the latest.
    short (*poll)(struct fake_file *file, uint64_t now_us, uint64_t *next_us);
};

struct fake_device {
    char path[64];
    unsigned major, minor;
    const struct fake_operations *operations;
    void *state;
    int memory_fd;               ///< memory shared by its open files; -1: each has its own
    char plug[FAKE_PATH_BYTES];  ///< connected while this file exists; "": always
};

/// An open descriptor. A device's descriptor is really a memory file, so that it counts as open and
/// can be mapped.
struct fake_file {
    bool known;
    int fd;
    struct fake_device *device;  ///< NULL: a real, watched file
    const struct fake_operations *operations;
    void *state;  ///< state of the device, or the one set by its `open` or `ioctl`
    char name[64];
    uint64_t plugged;  ///< fake_file_plugged() when it was opened
    bool dead;         ///< it has been unplugged since
};

/// Adds a device; there must be room.
struct fake_device *fake_file_device(const char *path, unsigned major, unsigned minor,
                                     const struct fake_operations *operations, void *state);
/// The device with this path, or NULL.
struct fake_device *fake_file_device_at(const char *path);
void fake_file_forget_all(void);
/// Creates the memory of all devices now, as a confined program cannot do so later.
void fake_file_prepare(void);

/// Number of the current connection of a device, different after each reconnection; 0: not
/// connected.
uint64_t fake_file_plugged(const struct fake_device *device);
/// Whether this file's device has been unplugged since it was opened.
bool fake_file_is_dead(struct fake_file *file);

/// The file of a descriptor, or NULL for other descriptors.
struct fake_file *fake_file_of(int fd);
/// A new descriptor for a device's (or line's) file; -errno.
int fake_file_new(const char *name, struct fake_device *device,
                  const struct fake_operations *operations, void *state);
/// Registers a real descriptor as a watched file.
void fake_file_adopt(int fd, const char *name);
void fake_file_drop(int fd);

/// What happens to a recorded call.
enum fake_fate { FAKE_RUN, FAKE_FAIL, FAKE_HALVE };

/// Records the call. FAKE_FAIL: errno is set. Does not return after a kill.
enum fake_fate fake_kernel_step(const char *name, const char *call, const char *details);

/// The watched file's name (in `name`), or false when the path is not watched.
bool fake_kernel_watches(const char *path, char *name, size_t bytes);

/// Waits until `until_us`, in real or virtual time.
void fake_kernel_sleep_until(uint64_t until_us);
bool fake_kernel_time_is_virtual(void);

/// Locks the fake kernel's state. Recursive.
void fake_kernel_lock(void);
void fake_kernel_unlock(void);

#endif

// SPDX-License-Identifier: Apache-2.0
/// Between the parts of the fake kernel: devices, open files, and the record.
#ifndef VERGENCE_TESTS_FAKE_FILE_H
#define VERGENCE_TESTS_FAKE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

enum { FAKE_FILES = 1024, FAKE_DEVICES = 8, FAKE_PATH_BYTES = 512, FAKE_LINE_BYTES = 1024 };

struct fake_file;

/// What a device does. Functions return >= 0 or -errno; NULL ones are ENOTTY (ioctl) or EINVAL.
struct fake_operations {
    int (*open)(struct fake_file *file);
    void (*close)(struct fake_file *file);
    /// Writes the request and its argument into `line`, as it is before the call.
    void (*describe)(struct fake_file *file, unsigned long request, const void *argument,
                     char *line, size_t bytes);
    int (*ioctl)(struct fake_file *file, unsigned long request, void *argument);
    int (*read)(struct fake_file *file, void *data, size_t bytes);
    int (*write)(struct fake_file *file, const void *data, size_t bytes);
    /// The events of poll at `now_us`. `*next_us` is when to ask again at the latest.
    short (*poll)(struct fake_file *file, uint64_t now_us, uint64_t *next_us);
};

struct fake_device {
    char path[64];
    unsigned major, minor;
    const struct fake_operations *operations;
    void *state;
    int memory_fd;               ///< what its open files share; -1: each has its own
    char plug[FAKE_PATH_BYTES];  ///< it is connected while this file is there; "": always
};

/// What an open descriptor is. A device's descriptor is a memory file of its own in truth, so that
/// it counts as open, and so that mapping it works.
struct fake_file {
    bool known;
    int fd;
    struct fake_device *device;  ///< NULL: a real, watched file
    const struct fake_operations *operations;
    void *state;  ///< of the device, or what its `open` or `ioctl` has put there
    char name[64];
    uint64_t plugged;  ///< which time it was connected when it was opened
    bool dead;         ///< it was pulled out meanwhile
};

/// Adds a device. There must be room.
struct fake_device *fake_file_device(const char *path, unsigned major, unsigned minor,
                                     const struct fake_operations *operations, void *state);
/// The device with this path, or NULL.
struct fake_device *fake_file_device_at(const char *path);
void fake_file_forget_all(void);
/// Makes the memory of all devices now: a program that confines itself cannot do so later.
void fake_file_prepare(void);

/// Which time a device is connected (a number that is another one after each time), 0: it is not.
uint64_t fake_file_plugged(const struct fake_device *device);
/// Whether the device of this file has been pulled out since it was opened.
bool fake_file_is_dead(struct fake_file *file);

/// The file of a descriptor, or NULL when it is none of ours.
struct fake_file *fake_file_of(int fd);
/// A new descriptor for a device's (or line's) file; -errno.
int fake_file_new(const char *name, struct fake_device *device,
                  const struct fake_operations *operations, void *state);
/// Makes a real descriptor known as a watched file.
void fake_file_adopt(int fd, const char *name);
void fake_file_drop(int fd);

/// What a seen call is to do.
enum fake_fate { FAKE_RUN, FAKE_FAIL, FAKE_HALVE };

/// Writes the line down. FAKE_FAIL: errno is set. May not return: a kill.
enum fake_fate fake_kernel_step(const char *name, const char *call, const char *details);

/// The watched file's name (in `name`), or false when the path is not watched.
bool fake_kernel_watches(const char *path, char *name, size_t bytes);

/// Waits until `until_us`, in whichever time counts.
void fake_kernel_sleep_until(uint64_t until_us);
/// The same, or until a device has something new; only a simulated rig says when that is.
void fake_kernel_wait_until(uint64_t until_us);
bool fake_kernel_time_is_virtual(void);

/// One at a time: the state of the fake kernel. Recursive.
void fake_kernel_lock(void);
void fake_kernel_unlock(void);

#endif

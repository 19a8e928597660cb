// SPDX-License-Identifier: Apache-2.0
// C library functions that replace system calls on descriptors.
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <termios.h>
#include <unistd.h>

#include "fake_file.h"

// Called by the fortified C library, which declares no prototype.
int __open_2(const char *path, int flags);
int __open64_2(const char *path, int flags);
ssize_t __read_chk(int fd, void *data, size_t bytes, size_t room);
ssize_t __pread_chk(int fd, void *data, size_t bytes, off_t offset, size_t room);
ssize_t __pread64_chk(int fd, void *data, size_t bytes, off64_t offset, size_t room);

/// A device function's result as a system call returns it.
static int as_call(int result) {
    if (result < 0) {
        errno = -result;
        return -1;
    }
    return result;
}

static void describe_flags(int flags, char *text, size_t bytes) {
    static const struct {
        int flag;
        const char *name;
    } names[] = {
        {O_CREAT, " create"},        {O_EXCL, " excl"},         {O_TRUNC, " trunc"},
        {O_APPEND, " append"},       {O_NOCTTY, " noctty"},     {O_NONBLOCK, " nonblock"},
        {O_DIRECTORY, " directory"}, {O_NOFOLLOW, " nofollow"}, {O_CLOEXEC, " cloexec"},
    };
    const int access = flags & O_ACCMODE;
    snprintf(text, bytes, "%s",
             access == O_RDONLY   ? "rdonly"
             : access == O_WRONLY ? "wronly"
                                  : "rdwr");
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if ((flags & names[i].flag) == names[i].flag) {
            strncat(text, names[i].name, bytes - strlen(text) - 1);
        }
    }
}

static int open_device(struct fake_device *device, const char *name) {
    fake_kernel_lock();
    int fd = fake_file_new(name, device, device->operations, device->state);
    if (fd >= 0 && device->operations->open != NULL) {
        const int result = device->operations->open(fake_file_of(fd));
        if (result < 0) {
            fake_file_drop(fd);
            syscall(SYS_close, fd);
            fd = result;
        }
    }
    fake_kernel_unlock();
    return as_call(fd);
}

static int open_any(int directory, const char *path, int flags, mode_t mode) {
    char name[64], details[128];
    struct fake_device *device = fake_file_device_at(path);
    bool seen = device != NULL;
    if (seen) {
        snprintf(name, sizeof name, "%s", strrchr(path, '/') + 1);
    } else if (path[0] != '/' && fake_file_of(directory) != NULL) {
        snprintf(name, sizeof name, "%s", path);
        seen = true;
    } else {
        seen = fake_kernel_watches(path, name, sizeof name);
    }
    if (seen) {
        describe_flags(flags, details, sizeof details);
        if (fake_kernel_step(name, "open", details) == FAKE_FAIL) {
            return -1;
        }
    }
    if (device != NULL) {
        return fake_file_plugged(device) == 0 ? as_call(-ENOENT) : open_device(device, name);
    }
    const int fd = (int)syscall(SYS_openat, directory, path, flags, mode);
    if (fd >= 0 && seen) {
        fake_file_adopt(fd, name);
    }
    return fd;
}

static mode_t mode_of(int flags, va_list arguments) {
    return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
}

#define OPEN_WITH(directory)                       \
    va_list arguments;                             \
    va_start(arguments, flags);                    \
    const mode_t mode = mode_of(flags, arguments); \
    va_end(arguments);                             \
    return open_any((directory), path, flags, mode)

int open(const char *path, int flags, ...) {
    OPEN_WITH(AT_FDCWD);
}

int open64(const char *path, int flags, ...) {
    OPEN_WITH(AT_FDCWD);
}

int openat(int directory, const char *path, int flags, ...) {
    OPEN_WITH(directory);
}

int openat64(int directory, const char *path, int flags, ...) {
    OPEN_WITH(directory);
}

int __open_2(const char *path, int flags) {
    return open_any(AT_FDCWD, path, flags, 0);
}

int __open64_2(const char *path, int flags) {
    return open_any(AT_FDCWD, path, flags, 0);
}

int close(int fd) {
    struct fake_file *file = fake_file_of(fd);
    enum fake_fate fate = FAKE_RUN;
    int error = 0;
    if (file != NULL) {
        // As on Linux, the descriptor is closed whatever close() returns.
        fate = fake_kernel_step(file->name, "close", "");
        error = errno;
        if (file->operations != NULL && file->operations->close != NULL) {
            file->operations->close(file);
        }
        fake_file_drop(fd);
    }
    const int result = (int)syscall(SYS_close, fd);
    if (fate == FAKE_FAIL) {
        errno = error;
        return -1;
    }
    return result;
}

static size_t part_of(enum fake_fate fate, size_t bytes) {
    return fate == FAKE_HALVE && bytes > 1 ? bytes / 2 : bytes;
}

ssize_t read(int fd, void *data, size_t bytes) {
    struct fake_file *file = fake_file_of(fd);
    if (file == NULL) {
        return syscall(SYS_read, fd, data, bytes);
    }
    char details[32];
    snprintf(details, sizeof details, "%zu", bytes);
    const enum fake_fate fate = fake_kernel_step(file->name, "read", details);
    if (fate == FAKE_FAIL) {
        return -1;
    }
    bytes = part_of(fate, bytes);
    if (file->operations == NULL) {
        return syscall(SYS_read, fd, data, bytes);
    }
    return as_call(file->operations->read == NULL ? -EINVAL
                                                  : file->operations->read(file, data, bytes));
}

ssize_t __read_chk(int fd, void *data, size_t bytes, size_t room) {
    if (bytes > room) {
        abort();
    }
    return read(fd, data, bytes);
}

ssize_t write(int fd, const void *data, size_t bytes) {
    struct fake_file *file = fake_file_of(fd);
    if (file == NULL) {
        return syscall(SYS_write, fd, data, bytes);
    }
    char details[32];
    snprintf(details, sizeof details, "%zu", bytes);
    const enum fake_fate fate = fake_kernel_step(file->name, "write", details);
    if (fate == FAKE_FAIL) {
        return -1;
    }
    bytes = part_of(fate, bytes);
    if (file->operations == NULL) {
        return syscall(SYS_write, fd, data, bytes);
    }
    return as_call(file->operations->write == NULL ? -EINVAL
                                                   : file->operations->write(file, data, bytes));
}

/// Records a call at an offset: how many bytes it may transfer; -1 with errno.
static ssize_t step_at(const struct fake_file *file, const char *call, size_t bytes, off_t offset) {
    char details[64];
    snprintf(details, sizeof details, "%zu at 0x%llx", bytes, (unsigned long long)offset);
    const enum fake_fate fate = fake_kernel_step(file->name, call, details);
    return fate == FAKE_FAIL ? -1 : (ssize_t)part_of(fate, bytes);
}

ssize_t pread(int fd, void *data, size_t bytes, off_t offset) {
    struct fake_file *file = fake_file_of(fd);
    if (file == NULL || file->operations == NULL || file->operations->pread == NULL) {
        return syscall(SYS_pread64, fd, data, bytes, offset);
    }
    const ssize_t part = step_at(file, "pread", bytes, offset);
    return part < 0 ? -1 : as_call(file->operations->pread(file, data, (size_t)part, offset));
}

ssize_t pread64(int fd, void *data, size_t bytes, off64_t offset) {
    return pread(fd, data, bytes, offset);
}

ssize_t __pread_chk(int fd, void *data, size_t bytes, off_t offset, size_t room) {
    if (bytes > room) {
        abort();
    }
    return pread(fd, data, bytes, offset);
}

ssize_t __pread64_chk(int fd, void *data, size_t bytes, off64_t offset, size_t room) {
    return __pread_chk(fd, data, bytes, offset, room);
}

ssize_t pwrite(int fd, const void *data, size_t bytes, off_t offset) {
    struct fake_file *file = fake_file_of(fd);
    if (file == NULL || file->operations == NULL || file->operations->pwrite == NULL) {
        return syscall(SYS_pwrite64, fd, data, bytes, offset);
    }
    const ssize_t part = step_at(file, "pwrite", bytes, offset);
    return part < 0 ? -1 : as_call(file->operations->pwrite(file, data, (size_t)part, offset));
}

ssize_t pwrite64(int fd, const void *data, size_t bytes, off64_t offset) {
    return pwrite(fd, data, bytes, offset);
}

int ioctl(int fd, unsigned long request, ...) {
    va_list arguments;
    va_start(arguments, request);
    void *argument = va_arg(arguments, void *);
    va_end(arguments);
    struct fake_file *file = fake_file_of(fd);
    if (file == NULL) {
        return (int)syscall(SYS_ioctl, fd, request, argument);
    }
    char details[FAKE_LINE_BYTES / 2];
    snprintf(details, sizeof details, "0x%lx", request);
    if (file->operations == NULL) {
        if (request == TIOCEXCL || request == TIOCNXCL) {
            snprintf(details, sizeof details, "%s", request == TIOCEXCL ? "TIOCEXCL" : "TIOCNXCL");
        }
    } else if (file->operations->describe != NULL) {
        file->operations->describe(file, request, argument, details, sizeof details);
    }
    if (fake_kernel_step(file->name, "ioctl", details) == FAKE_FAIL) {
        return -1;
    }
    if (file->operations == NULL) {
        return (int)syscall(SYS_ioctl, fd, request, argument);
    }
    if (fake_file_is_dead(file)) {
        return as_call(-ENODEV);
    }
    if (file->operations->ioctl == NULL) {
        return as_call(-ENOTTY);
    }
    fake_kernel_lock();
    const int result = file->operations->ioctl(file, request, argument);
    fake_kernel_unlock();
    return as_call(result);
}

static void *map(void *address, size_t bytes, int protection, int flags, int fd, off_t offset) {
    struct fake_file *file = (flags & MAP_ANONYMOUS) != 0 ? NULL : fake_file_of(fd);
    if (file != NULL) {
        char details[64];
        snprintf(details, sizeof details, "%zu at 0x%llx", bytes, (unsigned long long)offset);
        if (fake_kernel_step(file->name, "mmap", details) == FAKE_FAIL) {
            return MAP_FAILED;
        }
    }
    // Returned as a number, as the C library's own wrapper does.
    const long result = syscall(SYS_mmap, address, bytes, protection, flags, fd, offset);
    return result == -1 ? MAP_FAILED : (void *)(uintptr_t)result;  // NOLINT
}

void *mmap(void *address, size_t bytes, int protection, int flags, int fd, off_t offset) {
    return map(address, bytes, protection, flags, fd, offset);
}

void *mmap64(void *address, size_t bytes, int protection, int flags, int fd, off64_t offset) {
    return map(address, bytes, protection, flags, fd, offset);
}

/// A call on a descriptor: 0; -1 if it fails; 1 if the real call is to be made.
static int step_on(int fd, const char *call, const char *details) {
    const struct fake_file *file = fake_file_of(fd);
    if (file == NULL || fake_kernel_step(file->name, call, details) != FAKE_FAIL) {
        return 1;
    }
    return -1;
}

int fsync(int fd) {
    if (fake_file_of(fd) == NULL) {
        return (int)syscall(SYS_fsync, fd);
    }
    // No real fsync: no test cuts the power, and thousands of syncs take minutes.
    return step_on(fd, "fsync", "") < 0 ? -1 : 0;
}

int ftruncate(int fd, off_t bytes) {
    return step_on(fd, "ftruncate", "") < 0 ? -1 : (int)syscall(SYS_ftruncate, fd, bytes);
}

int flock(int fd, int operation) {
    return step_on(fd, "flock", "") < 0 ? -1 : (int)syscall(SYS_flock, fd, operation);
}

int renameat(int from_directory, const char *from, int to_directory, const char *to) {
    if (from_directory == AT_FDCWD && to_directory == AT_FDCWD) {
        return rename(from, to);
    }
    char details[2 * 64 + 2];
    snprintf(details, sizeof details, "%.60s %.60s", from, to);
    return step_on(from_directory, "rename", details) < 0
               ? -1
               : (int)syscall(SYS_renameat2, from_directory, from, to_directory, to, 0);
}

int rename(const char *from, const char *to) {
    char name[64], other[64];
    if (fake_kernel_watches(from, name, sizeof name) &&
        fake_kernel_watches(to, other, sizeof other) &&
        fake_kernel_step(name, "rename", other) == FAKE_FAIL) {
        return -1;
    }
    return (int)syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
}

int unlinkat(int directory, const char *path, int flags) {
    return step_on(directory, "unlink", path) < 0
               ? -1
               : (int)syscall(SYS_unlinkat, directory, path, flags);
}

int mkdir(const char *path, mode_t mode) {
    char name[64];
    if (fake_kernel_watches(path, name, sizeof name) &&
        fake_kernel_step(name, "mkdir", "") == FAKE_FAIL) {
        return -1;
    }
    return (int)syscall(SYS_mkdirat, AT_FDCWD, path, mode);
}

// The C library makes these system calls internally.

/// The next definition of this function after ours.
static void *next_function(const char *name) {
    void *function = dlsym(RTLD_NEXT, name);
    if (function == NULL) {
        abort();
    }
    return function;
}

#define NEXT(type, name)                       \
    static type next;                          \
    if (next == NULL) {                        \
        *(void **)&next = next_function(name); \
    }

struct dirent *readdir(DIR *stream) {
    typedef struct dirent *(*function)(DIR *);
    NEXT(function, "readdir");
    return step_on(dirfd(stream), "readdir", "") < 0 ? NULL : next(stream);
}

int closedir(DIR *stream) {
    typedef int (*function)(DIR *);
    NEXT(function, "closedir");
    if (fake_file_of(dirfd(stream)) != NULL) {
        fake_file_drop(dirfd(stream));
    }
    return next(stream);
}

int tcgetattr(int fd, struct termios *settings) {
    typedef int (*function)(int, struct termios *);
    NEXT(function, "tcgetattr");
    if (step_on(fd, "tcgetattr", "") < 0) {
        return -1;
    }
    return next(fd, settings);
}

int tcsetattr(int fd, int when, const struct termios *settings) {
    typedef int (*function)(int, int, const struct termios *);
    NEXT(function, "tcsetattr");
    if (step_on(fd, "tcsetattr", when == TCSANOW ? "now" : "later") < 0) {
        return -1;
    }
    return next(fd, when, settings);
}

int tcflush(int fd, int which) {
    typedef int (*function)(int, int);
    NEXT(function, "tcflush");
    const char *details = which == TCIFLUSH ? "in" : which == TCOFLUSH ? "out" : "both";
    if (step_on(fd, "tcflush", details) < 0) {
        return -1;
    }
    return next(fd, which);
}

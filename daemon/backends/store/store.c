// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/store/store.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/directory_names.h"
#include "daemon/files/file_io.h"
#include "daemon/files/own_remove.h"

enum {
    HEADER_BYTES = 58,
    RECORD_MAX = 999999999,  // limited by the header's digits
};

static bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

static bool is_name(const char *name) {
    if (!is_letter(name[0])) {
        return false;
    }
    size_t length = 0;
    for (; name[length] != '\0' && length <= HAL_STORE_NAME_MAX; length++) {
        const char c = name[length];
        if (!is_letter(c) && !(c >= '0' && c <= '9') && strchr("-_.", c) == NULL) {
            return false;
        }
    }
    return length <= HAL_STORE_NAME_MAX;
}

/// Makes the first line of a record's file. The checksum covers the name, so that a file under
/// another record's name is rejected.
static void make_header(const char *name, const void *data, size_t bytes,
                        char header[HEADER_BYTES + 1]) {
    INVARIANT(bytes <= RECORD_MAX);
    uint32_t crc = crc_update(0, name, strlen(name) + 1);
    crc = crc_update(crc, data, bytes);
    const int length =
        snprintf(header, HEADER_BYTES + 1, "vergence record 1: %9zu bytes follow, crc32 %08x\n",
                 bytes, (unsigned)crc);
    INVARIANT(length == HEADER_BYTES);
}

/// Opens a file of the directory, restarting after a signal; -1 with errno.
static int open_file(const struct store *self, const char *name, int flags) {
    int fd = -1;
    do {
        fd = openat(self->directory_fd, name, flags | O_CLOEXEC | O_NOFOLLOW | O_NOCTTY, 0600);
    } while (fd < 0 && errno == EINTR);
    return fd;
}

/// Closes once, whatever it returns: Linux always frees the descriptor.
static bool close_fd(int fd) {
    return close(fd) == 0 || errno == EINTR;
}

/// Reads until `bytes` are read or the file ends; returns their number, or -1 with errno.
static ssize_t read_all(int fd, void *data, size_t bytes) {
    char *next = data;
    size_t got = 0;
    while (got < bytes) {
        const ssize_t more = read(fd, next + got, bytes - got);
        if (more == 0) {
            break;
        }
        if (more > 0) {
            got += (size_t)more;
        } else if (errno != EINTR) {
            return -1;
        }
    }
    return (ssize_t)got;
}

/// The number of bytes that a header states, or -1 if it is invalid.
static long promised_bytes(const char header[HEADER_BYTES]) {
    static const char before[] = "vergence record 1: ";
    enum { DIGITS = 9 };
    if (memcmp(header, before, sizeof before - 1) != 0) {
        return -1;
    }
    long bytes = 0;
    for (int i = 0; i < DIGITS; i++) {
        const char c = header[sizeof before - 1 + (size_t)i];
        if (c >= '0' && c <= '9') {
            bytes = 10 * bytes + (c - '0');
        } else if (c != ' ' || bytes != 0) {
            return -1;
        }
    }
    return bytes;
}

static int load_from(int fd, const char *name, void *data, size_t capacity, size_t *bytes) {
    char header[HEADER_BYTES], expected[HEADER_BYTES + 1], extra;
    ssize_t got = read_all(fd, header, HEADER_BYTES);
    if (got < 0) {
        return file_error(errno);
    }
    const long promised = got == HEADER_BYTES ? promised_bytes(header) : -1;
    if (promised < 0) {
        return ERROR_CRC;
    }
    if ((size_t)promised > capacity) {
        return ERROR_BUFFER;
    }
    got = read_all(fd, data, (size_t)promised);
    const ssize_t more = got < 0 ? -1 : read_all(fd, &extra, 1);
    if (got < 0 || more < 0) {
        return file_error(errno);
    }
    make_header(name, data, (size_t)got, expected);
    if (more != 0 || got != promised || memcmp(header, expected, HEADER_BYTES) != 0) {
        return ERROR_CRC;
    }
    *bytes = (size_t)got;
    return ERROR_OK;
}

static int load(void *opaque, const char *name, void *data, size_t capacity, size_t *bytes) {
    const struct store *self = opaque;
    INVARIANT(self->directory_fd >= 0);
    if (!is_name(name)) {
        return ERROR_ARGUMENT;
    }
    const int fd = open_file(self, name, O_RDONLY | O_NONBLOCK);
    if (fd < 0) {
        return file_error(errno);
    }
    const int error = load_from(fd, name, data, capacity, bytes);
    close_fd(fd);
    return error;
}

static int save(void *opaque, const char *name, const void *data, size_t bytes) {
    const struct store *self = opaque;
    INVARIANT(self->directory_fd >= 0 && (data != NULL || bytes == 0));
    if (!is_name(name)) {
        return ERROR_ARGUMENT;
    }
    if (bytes > RECORD_MAX) {
        return ERROR_FULL;
    }
    char header[HEADER_BYTES + 1];
    struct atomic_file file;
    make_header(name, data, bytes, header);
    if (atomic_file_begin(&file, self->directory_fd, name, 0600)) {
        const bool written =
            write_all(file.fd, header, HEADER_BYTES) && write_all(file.fd, data, bytes);
        if (atomic_file_end(&file, written)) {
            return ERROR_OK;
        }
    }
    return errno == ENOENT ? ERROR_IO : file_error(errno);
}

static bool is_record(const void *listing, const char *name) {
    (void)listing;
    return is_name(name);
}

static int remove_record(void *opaque, const char *name) {
    const struct store *self = opaque;
    INVARIANT(self->directory_fd >= 0);
    if (!is_name(name)) {
        return ERROR_ARGUMENT;
    }
    // Its directory is the store's alone, which is locked: the name is listed by being a record's.
    const struct own_proof proof = {.kind = OWN_LISTED, .lists = is_record};
    if (!own_remove(self->directory_fd, name, &proof) || !sync_file(self->directory_fd)) {
        return file_error(errno);
    }
    return ERROR_OK;
}

/// What to do about errno, as the end of a sentence.
static const char *advice(int error_number) {
    switch (error_number) {
        case EWOULDBLOCK:
            return "end the other process that uses it";
        case ENOENT:
            return "create its parent directory";
        case ENOTDIR:
            return "give a directory";
        case EACCES:
        case EPERM:
            return "it must belong to the user who runs vergenced";
        default:
            return "give a writable directory";
    }
}

/// Creates, opens and locks the directory; returns its descriptor, or -1 with errno. An existing
/// one may have been created just before a kill, so its name is synced too, if possible.
static int open_directory(const char *path) {
    const bool made = mkdir(path, 0700) == 0;
    if (!made && errno != EEXIST) {
        const int error_number = errno;
        // A read-only file system may still contain it.
        if (error_number != EROFS && error_number != EACCES && error_number != EPERM) {
            return -1;
        }
    }
    int fd = -1;
    do {
        fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    } while (fd < 0 && errno == EINTR);
    if (fd >= 0 && (flock(fd, LOCK_EX | LOCK_NB) != 0 || (!sync_directory_at(fd, "..") && made))) {
        const int error_number = errno;
        close_fd(fd);
        errno = error_number;
        return -1;
    }
    return fd;
}

int store_open(struct store *self, const char *path, struct message *message) {
    static const struct hal_store_operations operations = {load, save, remove_record};
    *self = (struct store){.hal = {&operations, self}, .directory_fd = -1};
    const int fd = open_directory(path);
    if (fd < 0) {
        const int error_number = errno;
        const int error = error_number == EWOULDBLOCK ? ERROR_REFUSED : file_error(error_number);
        return message_set(message, error, "settings directory %s: %s (%s)", path,
                           error_number == EWOULDBLOCK ? "locked" : strerror(error_number),
                           advice(error_number));
    }
    self->directory_fd = fd;
    own_remove_abandoned(fd, true);
    return ERROR_OK;
}

void store_close(struct store *self) {
    if (self->directory_fd >= 0) {
        close_fd(self->directory_fd);
        self->directory_fd = -1;
    }
}

int64_t store_saved_s(const struct store *self, const char *name) {
    struct stat status;
    return is_name(name) && fstatat(self->directory_fd, name, &status, AT_SYMLINK_NOFOLLOW) == 0
               ? (int64_t)status.st_mtime
               : 0;
}

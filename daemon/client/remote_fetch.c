// SPDX-License-Identifier: Apache-2.0
// Fetches a file of the instrument, block by block.
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/base64.h"
#include "daemon/client/remote.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/file_io.h"

enum {
    BLOCK_SERIAL = 1536,
    BLOCK_SOCKET = 49152,
    PATH_BYTES = 4096,
    TEXT_BYTES = BASE64_TEXT_BYTES(BLOCK_SOCKET)
};

/// A fetch in progress.
struct fetch {
    struct remote *remote;
    const char *name, *local;
    char part[PATH_BYTES];
    int fd;
    uint64_t size;
    uint32_t crc;
    char text[TEXT_BYTES];
    uint8_t data[BLOCK_SOCKET];
};

static bool read_crc(const struct cJSON *result, uint32_t *crc) {
    char text[16];
    if (!json_member_text(result, "crc", text, sizeof text) || strlen(text) != 8) {
        return false;
    }
    *crc = (uint32_t)strtoul(text, NULL, 16);
    return true;
}

/// Makes the request line; `rest` follows the name. `command` has REMOTE_REQUEST_BYTES.
static int make_command(const struct fetch *self, const char *rest, char *command,
                        struct message *message) {
    char name[REMOTE_REQUEST_BYTES];
    if (remote_quote(self->name, name)) {
        const int length = snprintf(command, REMOTE_REQUEST_BYTES, "fetch %s%s", name, rest);
        if (length > 0 && length < REMOTE_REQUEST_BYTES) {
            return 0;
        }
    }
    return message_set(message, ERROR_ARGUMENT, "%s: name too long", self->name);
}

/// Gets length and CRC-32 of the whole file.
static int describe(struct fetch *self, struct message *message) {
    char command[REMOTE_REQUEST_BYTES];
    const struct cJSON *result = NULL;
    int64_t size = -1;
    int error = make_command(self, "", command, message);
    error = error != 0 ? error : remote_call(self->remote, command, &result, message);
    if (error != 0) {
        return error;
    }
    if (!json_member_integer(result, "size", &size) || size < 0 || !read_crc(result, &self->crc)) {
        return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
    }
    self->size = (uint64_t)size;
    return 0;
}

/// Fetches the block at `offset` and appends it. `*got`: its length in bytes.
static int fetch_block(struct fetch *self, uint64_t offset, size_t *got, struct message *message) {
    char command[REMOTE_REQUEST_BYTES];
    char rest[64];
    const struct cJSON *result = NULL;
    int64_t at = -1;
    uint32_t crc = 0;
    const int max = self->remote->line.serial ? BLOCK_SERIAL : BLOCK_SOCKET;
    snprintf(rest, sizeof rest, " offset=%" PRIu64 " bytes=%d", offset, max);
    int error = make_command(self, rest, command, message);
    error = error != 0 ? error : remote_call(self->remote, command, &result, message);
    if (error != 0) {
        return error;
    }
    long bytes = -1;
    if (json_member_integer(result, "offset", &at) && (uint64_t)at == offset &&
        read_crc(result, &crc) && json_member_text(result, "data", self->text, sizeof self->text)) {
        bytes = base64_decode(self->text, self->data, sizeof self->data);
    }
    if (bytes <= 0 || crc_update(0, self->data, (size_t)bytes) != crc) {
        return message_set(message, ERROR_CRC, "%s: changed during the transfer (try again)",
                           self->name);
    }
    INVARIANT((size_t)bytes <= sizeof self->data);
    if (lseek(self->fd, (off_t)offset, SEEK_SET) < 0 ||
        !write_all(self->fd, self->data, (size_t)bytes)) {
        return message_set(message, ERROR_IO, "%s: %s", self->part, strerror(errno));
    }
    *got = (size_t)bytes;
    return 0;
}

static int fetch_rest(struct fetch *self, uint64_t offset, struct message *message) {
    while (offset < self->size) {
        size_t got = 0;
        const int error = fetch_block(self, offset, &got, message);
        if (error != 0) {
            remote_progress(self->remote, "", 0, 0);
            return error;
        }
        offset += got;
        remote_progress(self->remote, self->name, offset, self->size);
    }
    remote_progress(self->remote, "", 0, 0);
    return 0;
}

/// Whether the CRC-32 of the partial file matches.
static bool is_right(struct fetch *self) {
    uint32_t crc = 0;
    uint64_t at = 0;
    for (;;) {
        const ssize_t bytes = pread(self->fd, self->data, sizeof self->data, (off_t)at);
        if (bytes <= 0) {
            break;
        }
        crc = crc_update(crc, self->data, (size_t)bytes);
        at += (uint64_t)bytes;
    }
    return at == self->size && crc == self->crc;
}

/// Truncates the partial file to `bytes`.
static int cut(struct fetch *self, uint64_t bytes, struct message *message) {
    return ftruncate(self->fd, (off_t)bytes) == 0
               ? 0
               : message_set(message, ERROR_IO, "%s: %s", self->part, strerror(errno));
}

/// Resumes an earlier attempt; starts over if it belongs to another file.
static int fetch_into_part(struct fetch *self, struct message *message) {
    struct stat about;
    uint64_t have = 0;
    if (fstat(self->fd, &about) == 0 && (uint64_t)about.st_size <= self->size) {
        have = (uint64_t)about.st_size;
    }
    int error = cut(self, have, message);
    error = error != 0 ? error : fetch_rest(self, have, message);
    if (error == 0 && have > 0 && !is_right(self)) {
        error = cut(self, 0, message);
        error = error != 0 ? error : fetch_rest(self, 0, message);
    }
    if (error == 0 && !is_right(self)) {
        return message_set(message, ERROR_CRC, "%s: changed during the transfer (try again)",
                           self->name);
    }
    return error;
}

/// Whatever has the local name is replaced, so it must be a file or not exist.
static int look_at_local(const char *local, struct message *message) {
    struct stat about;
    if (stat(local, &about) == 0 && !S_ISREG(about.st_mode)) {
        return message_set(
            message, ERROR_ARGUMENT, "%s: exists and is not a file (%s)", local,
            S_ISDIR(about.st_mode) ? "it is a directory: give a name in it" : "give another name");
    }
    return 0;
}

static int open_part(struct fetch *self, struct message *message) {
    struct stat about;
    const int length = snprintf(self->part, sizeof self->part, "%s.part", self->local);
    if (length < 0 || (size_t)length >= sizeof self->part) {
        return message_set(message, ERROR_ARGUMENT, "local file name too long");
    }
    // Non-blocking, as it may be something other than a file, which is only inspected.
    self->fd =
        open(self->part, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0644);
    if (self->fd < 0) {
        return message_set(message, ERROR_IO, "%s: %s", self->part, strerror(errno));
    }
    return fstat(self->fd, &about) == 0 && S_ISREG(about.st_mode)
               ? 0
               : message_set(message, ERROR_ARGUMENT, "%s: exists and is not a file (remove it)",
                             self->part);
}

/// Gives the complete file its name, durably: after a power loss there is no name without its
/// contents, and once success was reported both exist.
static int give_name(const struct fetch *self, struct message *message) {
    return atomic_file_rename(AT_FDCWD, self->fd, self->part, self->local)
               ? 0
               : message_set(message, ERROR_IO, "%s: %s", self->local, strerror(errno));
}

/// Starts a fetch; the caller frees it. NULL with `message`: out of memory.
static struct fetch *begin(struct remote *remote, const char *name, const char *local,
                           struct message *message) {
    struct fetch *self = malloc(sizeof *self);
    if (self == NULL) {
        message_set(message, ERROR_MEMORY, "out of memory");
        return NULL;
    }
    self->remote = remote;
    self->name = name;
    self->local = local;
    self->fd = -1;
    return self;
}

int remote_fetch_compare(struct remote *remote, const char *name, const char *local, bool *same,
                         struct message *message) {
    struct fetch *self = begin(remote, name, local, message);
    if (self == NULL) {
        return ERROR_MEMORY;
    }
    int error = look_at_local(local, message);
    error = error != 0 ? error : describe(self, message);
    if (error == 0) {
        self->fd = open(local, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
        *same = self->fd >= 0 && is_right(self);
        error =
            self->fd >= 0 ? 0 : message_set(message, ERROR_IO, "%s: %s", local, strerror(errno));
    }
    if (error == 0) {
        close(self->fd);
    }
    free(self);
    return error;
}

int remote_fetch(struct remote *remote, const char *name, const char *local, uint64_t *bytes,
                 struct message *message) {
    struct fetch *self = begin(remote, name, local, message);
    if (self == NULL) {
        return ERROR_MEMORY;
    }
    int error = describe(self, message);
    error = error != 0 ? error : look_at_local(local, message);
    error = error != 0 ? error : open_part(self, message);
    error = error != 0 ? error : fetch_into_part(self, message);
    error = error != 0 ? error : give_name(self, message);
    if (self->fd >= 0) {
        close(self->fd);
    }
    *bytes = error == 0 ? self->size : 0;
    free(self);
    return error;
}

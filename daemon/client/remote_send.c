// SPDX-License-Identifier: Apache-2.0
// Sends a local file to the instrument, block by block.
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/base64.h"
#include "daemon/client/remote.h"
#include "daemon/files/file_io.h"

/// Commands are limited to 512 characters, so blocks are small on any line.
enum { BLOCK_BYTES = 288, READ_BYTES = 16384, TRIES = 2 };

/// A send in progress.
struct send {
    struct remote *remote;
    const char *local, *name;
    int fd;
    uint64_t size;
    uint32_t crc;
    uint64_t have;  ///< bytes that the instrument has
    bool whole;     ///< the instrument has all of it
};

/// Gets length and CRC-32 of the local file.
static int describe(struct send *self, struct message *message) {
    unsigned char data[READ_BYTES];
    struct stat about;
    if (fstat(self->fd, &about) != 0 || !S_ISREG(about.st_mode)) {
        return message_set(message, ERROR_ARGUMENT, "%s: not a file", self->local);
    }
    for (;;) {
        const ssize_t bytes = pread(self->fd, data, sizeof data, (off_t)self->size);
        if (bytes < 0) {
            return message_set(message, ERROR_IO, "%s: %s", self->local, strerror(errno));
        }
        if (bytes == 0) {
            return 0;
        }
        self->crc = crc_update(self->crc, data, (size_t)bytes);
        self->size += (uint64_t)bytes;
    }
}

/// Sends a command and reads how much the instrument has.
static int report(struct send *self, const char *rest, struct message *message) {
    char command[REMOTE_REQUEST_BYTES];
    char name[REMOTE_REQUEST_BYTES];
    char whole[8] = "";
    const struct cJSON *result = NULL;
    int64_t have = -1;
    const bool fits = remote_quote(self->name, name);
    const int length = snprintf(command, sizeof command, "send %s %" PRIu64 " %08" PRIX32 "%s",
                                fits ? name : "", self->size, self->crc, rest);
    if (!fits || length < 0 || (size_t)length >= sizeof command) {
        return message_set(message, ERROR_ARGUMENT, "%s: name too long", self->name);
    }
    const int error = remote_call(self->remote, command, &result, message);
    if (error != 0) {
        return error;
    }
    if (!json_member_integer(result, "have", &have) || have < 0 || (uint64_t)have > self->size ||
        !json_member_text(result, "whole", whole, sizeof whole)) {
        return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
    }
    self->have = (uint64_t)have;
    self->whole = strcmp(whole, "yes") == 0;
    return 0;
}

static int send_block(struct send *self, struct message *message) {
    unsigned char data[BLOCK_BYTES];
    char text[BASE64_TEXT_BYTES(BLOCK_BYTES)];
    char rest[sizeof text + 64];
    const uint64_t offset = self->have;
    const ssize_t bytes = pread(self->fd, data, sizeof data, (off_t)offset);
    if (bytes <= 0) {
        return message_set(message, ERROR_IO, "%s: %s", self->local,
                           bytes == 0 ? "changed during the transfer" : strerror(errno));
    }
    base64_encode(data, (size_t)bytes, text);
    snprintf(rest, sizeof rest, " offset=%" PRIu64 " block-crc=%08" PRIX32 " data=%s", offset,
             crc_update(0, data, (size_t)bytes), text);
    const int error = report(self, rest, message);
    if (error == 0 && !self->whole && self->have <= offset) {
        return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
    }
    return error;
}

/// Resumes an earlier attempt.
static int send_rest(struct send *self, bool *resumed, struct message *message) {
    int error = report(self, "", message);
    *resumed = error != 0 || self->have > 0;
    while (error == 0 && !self->whole) {
        error = send_block(self, message);
        remote_progress(self->remote, self->name, self->have, self->size);
    }
    remote_progress(self->remote, "", 0, 0);
    return error;
}

int remote_send(struct remote *remote, const char *local, const char *name, uint64_t *bytes,
                struct message *message) {
    struct send self = {.remote = remote, .local = local, .name = name};
    self.fd = open(local, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (self.fd < 0) {
        return message_set(message, file_error(errno), "%s: %s", local, strerror(errno));
    }
    int error = describe(&self, message);
    bool resumed = error == 0;
    // Data of an earlier attempt may be damaged: the instrument reports that at the end and
    // discards it.
    for (int i = 0; i < TRIES && resumed && (i == 0 || error == ERROR_REFUSED); i++) {
        error = send_rest(&self, &resumed, message);
    }
    INVARIANT(error != 0 || self.whole);
    close(self.fd);
    *bytes = error == 0 ? self.size : 0;
    return error;
}

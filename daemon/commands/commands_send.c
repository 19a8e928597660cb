// SPDX-License-Identifier: Apache-2.0
// Receives a client's file in blocks into the instrument's files. Each command identifies the file
// (name, length and CRC-32 of the whole), so the daemon keeps no state in memory: the connection
// may break, and the daemon may be killed. The data goes to a hidden file, which is renamed once it
// is complete and its CRC-32 is correct.
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/base64.h"
#include "core/crc.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/commands/space_check.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/own_remove.h"

/// Ending of the hidden files, by which abandoned ones are found.
#define PART_END ".send"

enum { ABANDONED_AFTER_S = 24 * 3600 };

/// One command: the file that it identifies, and how much of that was received.
struct receipt {
    const struct command_call *call;
    int root;
    const char *name;
    int64_t size;
    struct file_blocks_sent sent;
    char part[FILE_BLOCKS_SENT_NAME_MAX + 48];
    int fd;  ///< descriptor of the hidden file
    int64_t have;
};

static int take_arguments(struct receipt *self) {
    const struct command_value *values = self->call->values;
    struct stat about;
    self->name = values[SEND_NAME].text;
    self->size = values[SEND_SIZE].integer;
    int error = files_need_directory(self->call);
    error = error != ERROR_OK ? error : files_check_plain(self->call, self->name);
    if (error != ERROR_OK) {
        return error;
    }
    self->root = daemon_of(self->call)->files_fd;
    if (fstatat(self->root, self->name, &about, AT_SYMLINK_NOFOLLOW) == 0 &&
        !S_ISREG(about.st_mode)) {
        return command_fail(self->call, ERROR_ARGUMENT,
                            "%s: exists and is not a regular file: use another name", self->name);
    }
    const int length = snprintf(self->part, sizeof self->part, ".%s.%" PRId64 "-%08" PRIX32 "%s",
                                self->name, self->size, self->sent.crc, PART_END);
    INVARIANT(length > 0 && (size_t)length < sizeof self->part);
    return ERROR_OK;
}

/// Whether a name is of the form that prepare_part gives: .NAME.SIZE-CRC.part
static bool is_part(const void *listing, const char *name) {
    static const char digits[] = "0123456789ABCDEF";
    (void)listing;
    const char *dash = strrchr(name, '-');
    const char *dot = dash;
    while (dot != NULL && dot > name && *dot != '.') {
        dot--;
    }
    return dot != NULL && name[0] == '.' && dot > name + 1 && dash > dot + 1 &&
           strspn(dot + 1, digits) == (size_t)(dash - dot - 1) &&
           strspn(dash + 1, digits) == FILE_BLOCKS_CRC_DIGITS &&
           strcmp(dash + 1 + FILE_BLOCKS_CRC_DIGITS, PART_END) == 0;
}

/// Removes hidden files that were not written to for ABANDONED_AFTER_S.
static void remove_abandoned(int root) {
    const struct own_proof proof = {.kind = OWN_LISTED, .lists = is_part};
    DIR *directory = files_list_below(root, "");
    if (directory == NULL) {
        return;
    }
    for (const struct dirent *entry = readdir(directory); entry != NULL;
         entry = readdir(directory)) {
        struct stat about;
        if (fstatat(root, entry->d_name, &about, AT_SYMLINK_NOFOLLOW) == 0 &&
            time(NULL) - about.st_mtime > ABANDONED_AFTER_S) {
            own_remove(root, entry->d_name, &proof);
        }
    }
    closedir(directory);
}

/// Sets `*same` to whether the file has the announced length and CRC-32. 0, ERROR_CANCELLED or
/// ERROR_IO.
static int compare(const struct receipt *self, int fd, bool *same) {
    struct stat about;
    uint64_t size = 0;
    uint32_t crc = 0;
    *same = false;
    if (fstat(fd, &about) != 0 || !S_ISREG(about.st_mode) || about.st_size != self->size) {
        return ERROR_OK;
    }
    const int error = files_sum(self->call, self->name, fd, &size, &crc);
    *same = error == ERROR_OK && (int64_t)size == self->size && crc == self->sent.crc;
    return error;
}

static int answer(const struct receipt *self, bool whole) {
    INVARIANT(!whole || self->have == self->size);
    file_blocks_reply_sent(self->call, (uint64_t)self->have, whole);
    return 0;
}

/// Sets `*there` to whether the same file was received before. 0 or ERROR_CANCELLED.
static int is_there(struct receipt *self, bool *there) {
    const int fd = openat(self->root, self->name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    *there = false;
    if (fd < 0) {
        return ERROR_OK;
    }
    const int error = compare(self, fd, there);
    close(fd);
    self->have = *there ? self->size : 0;
    return error;
}

static void remove_part(const struct receipt *self) {
    own_remove(self->root, self->part, &(struct own_proof){.kind = OWN_OPEN, .fd = self->fd});
}

/// After the last byte: checks length and CRC-32, syncs the file and gives it its name.
static int finish(struct receipt *self) {
    bool same = false;
    const int error = compare(self, self->fd, &same);
    if (error != ERROR_OK) {
        return error;
    }
    if (!same) {
        remove_part(self);
        return command_fail(self->call, ERROR_VERIFY,
                            "%s: CRC-32 differs from the announced one: send the file again",
                            self->name);
    }
    if (!atomic_file_rename(self->root, self->fd, self->part, self->name)) {
        // Cached data would pass the next check without being on the disk.
        const int number = errno;
        remove_part(self);
        return files_refuse(self->call, self->name, number);
    }
    return answer(self, true);
}

/// Command without a block: reports how much was received, and creates the hidden file.
static int announce(struct receipt *self) {
    bool there = false;
    remove_abandoned(self->root);
    const int error = is_there(self, &there);
    if (error != ERROR_OK || there) {
        return error != ERROR_OK ? error : answer(self, true);
    }
    struct stat about;
    self->fd = openat(self->root, self->part, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0640);
    if (self->fd < 0 || fstat(self->fd, &about) != 0) {
        return files_refuse(self->call, self->name, errno);
    }
    self->have = about.st_size;
    if (self->have >= self->size) {
        return finish(self);
    }
    const struct free_space rest = {.files_bytes = (uint64_t)(self->size - self->have)};
    const int full = space_check(self->call, &rest, NULL);
    return full != 0 ? full : answer(self, false);
}

/// Writes a block at its offset. If the disk takes only a part, truncates the file to the length
/// before and reports the error.
static int write_block(struct receipt *self, int64_t offset, const uint8_t *data, size_t bytes) {
    const ssize_t written = pwrite(self->fd, data, bytes, offset);
    if (written != (ssize_t)bytes) {
        const int number = written < 0 ? errno : ENOSPC;
        const bool kept = ftruncate(self->fd, self->have) == 0;
        return files_refuse(self->call, kept ? self->name : self->part, number);
    }
    const int64_t end = offset + (int64_t)bytes;
    self->have = end > self->have ? end : self->have;
    return 0;
}

/// Answers a block whose hidden file cannot be opened: the file is complete, or was not announced.
/// `number`: errno of the attempt.
static int answer_unannounced(struct receipt *self, int number) {
    bool there = false;
    const int error = number == ENOENT ? is_there(self, &there) : 0;
    if (error != ERROR_OK || there) {
        return error != ERROR_OK ? error : answer(self, true);
    }
    return command_fail(self->call, ERROR_MISSING,
                        "%s: not announced (\"send NAME SIZE CRC\" first)", self->name);
}

/// A block may come more than once, as its sender cannot know which answers were lost.
static int take_block(struct receipt *self) {
    const int64_t offset = self->call->values[SEND_OFFSET].integer;
    const int64_t bytes = (int64_t)self->sent.bytes;
    struct stat about;
    self->fd = openat(self->root, self->part, O_RDWR | O_NOFOLLOW | O_CLOEXEC);
    if (self->fd < 0) {
        return answer_unannounced(self, errno);
    }
    if (fstat(self->fd, &about) != 0) {
        return files_refuse(self->call, self->name, errno);
    }
    self->have = about.st_size;
    if (offset > self->have || offset + bytes > self->size) {
        return command_fail(self->call, ERROR_RANGE,
                            "%s: invalid block: bytes %" PRId64 " to %" PRId64
                            " (received: %" PRId64 " of %" PRId64 ")",
                            self->name, offset, offset + bytes, self->have, self->size);
    }
    const int error = write_block(self, offset, self->sent.data, self->sent.bytes);
    if (error != ERROR_OK) {
        return error;
    }
    return self->have == self->size ? finish(self) : answer(self, false);
}

static int run_send(const struct command_call *call) {
    struct receipt receipt = {.call = call, .root = -1, .fd = -1};
    int error = file_blocks_take_sent(call, &receipt.sent);
    error = error != ERROR_OK ? error : take_arguments(&receipt);
    if (error == ERROR_OK) {
        error = receipt.sent.is_block ? take_block(&receipt) : announce(&receipt);
    }
    if (receipt.fd >= 0) {
        close(receipt.fd);
    }
    return error;
}

static const struct command commands[] = {
    {.name = "send",
     .summary = "receive a block of a file (vergence --connect sends whole files)",
     .help = "The file appears once it is complete and its CRC-32 (as in zlib) is correct. An "
             "incomplete one is kept for a day, to be continued.",
     .arguments = file_blocks_send_arguments,
     .argument_count = SEND_ARGUMENTS,
     .flags = COMMAND_NO_RIG | COMMAND_GROUP_FILES,
     .run = run_send},
};

const struct command *commands_send_table(size_t *count) {
    *count = 1;
    return commands;
}

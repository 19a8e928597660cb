// SPDX-License-Identifier: Apache-2.0
// Writes a new image of the board into flash. The image is checked before anything is written. Of
// two slots the older one is written, so that the other one boots whatever happens; the boot loader
// takes the newest whole one. The first block of a slot is erased first and written last: an image
// that is not whole has no header.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/commands/space_check.h"
#include "daemon/system/fit.h"
#include "daemon/system/flash.h"
#include "daemon/system/tftp.h"

enum { IMAGE, OLDER };
enum { SLOTS = 2, VERIFY_BYTES = 16384 };

/// A partition for an image, and the image in it.
struct slot {
    struct flash flash;
    bool valid;
    struct fit fit;
    struct message why;  ///< not valid
};

struct update {
    const struct command_call *call;
    struct slot slots[SLOTS];
    size_t slot_count;
    uint8_t *data;  ///< the slot or image that is looked at
    size_t capacity;
    struct fit image;
    struct message message;
};

static int fail(const struct update *self, int error, const char *what) {
    return command_fail(self->call, error, "%s%s%.900s", what, what[0] != '\0' ? ": " : "",
                        self->message.text);
}

// ---- slots

static int open_slots(struct update *self) {
    const struct config *config = &daemon_of(self->call)->config;
    const char *const names[SLOTS] = {config->image_slot, config->image_slot_2};
    if (config->board[0] == '\0' || config->image_slot[0] == '\0') {
        return command_fail(self->call, ERROR_UNSUPPORTED, "update is disabled: \"%s\" is not set",
                            config->board[0] == '\0' ? "board" : "image_slot");
    }
    for (size_t i = 0; i < SLOTS && names[i][0] != '\0'; i++) {
        struct slot *slot = &self->slots[i];
        const int error = flash_open(&slot->flash, names[i], &self->message);
        if (error != ERROR_OK) {
            return fail(self, error, "");
        }
        self->slot_count++;
        self->capacity = slot->flash.bytes > self->capacity ? slot->flash.bytes : self->capacity;
    }
    return ERROR_OK;
}

static void close_slots(struct update *self) {
    for (size_t i = 0; i < self->slot_count; i++) {
        flash_close(&self->slots[i].flash);
    }
}

/// Memory for one image, if enough is free.
static int take_memory(struct update *self) {
    const struct free_space need = {.memory_bytes = self->capacity};
    const int error = space_check(self->call, &need, "remove files");
    if (error != ERROR_OK) {
        return error;
    }
    self->data = malloc(self->capacity);
    return self->data != NULL ? 0 : command_fail(self->call, ERROR_MEMORY, "out of memory");
}

/// Reads and checks the image of a slot.
static int inspect_slot(struct update *self, struct slot *slot) {
    size_t bytes = 0;
    int error = flash_read(&slot->flash, 0, self->data, FIT_HEADER_BYTES, &self->message);
    if (error == ERROR_OK && fit_begins(self->data, &bytes) && bytes <= slot->flash.bytes) {
        error = flash_read(&slot->flash, 0, self->data, bytes, &self->message);
    }
    if (error != ERROR_OK) {
        return fail(self, error, "");
    }
    // Without a header the check does not look at the rest.
    slot->valid = fit_check(self->data, slot->flash.bytes, &slot->fit, &slot->why) == 0;
    return ERROR_OK;
}

static int inspect_slots(struct update *self) {
    int error = 0;
    for (size_t i = 0; i < self->slot_count && error == ERROR_OK; i++) {
        error = inspect_slot(self, &self->slots[i]);
    }
    return error;
}

static void reply_time(const struct command_call *call, uint32_t timestamp) {
    char text[FIT_TIME_BYTES];
    fit_time_text(timestamp, text);
    reply_text(call, "made", text);
}

static void reply_slots(const struct update *self) {
    reply_group_begin(self->call, "slots", true);
    for (size_t i = 0; i < self->slot_count; i++) {
        const struct slot *slot = &self->slots[i];
        reply_group_begin(self->call, NULL, false);
        reply_text(self->call, "slot", slot->flash.name);
        reply_text(self->call, "image", slot->valid ? slot->fit.board : "none");
        if (!slot->valid) {
            reply_text(self->call, "reason", slot->why.text);
        } else {
            reply_time(self->call, slot->fit.timestamp);
            reply_number(self->call, "size", (double)slot->fit.bytes, 0, "bytes");
        }
        reply_group_end(self->call);
    }
    reply_group_end(self->call);
}

/// The slot to be written: one without a whole image, else the older one. Of equal ones the boot
/// loader takes the first.
static size_t choose_slot(const struct update *self) {
    const struct slot *first = &self->slots[0], *second = &self->slots[1];
    return self->slot_count == 1 || !first->valid ||
                   (second->valid && first->fit.timestamp < second->fit.timestamp)
               ? 0
               : 1;
}

// ---- the image

static int load_file(struct update *self, const char *name, size_t *bytes) {
    struct stat about;
    const int fd = files_open(self->call, name);
    if (fd < 0) {
        return fd;
    }
    int error = fstat(fd, &about) != 0 ? ERROR_IO : 0;
    if (error == ERROR_OK && (uint64_t)about.st_size > self->capacity) {
        error = command_fail(self->call, ERROR_TOO_LARGE, "%s: larger than the slot of %zu bytes",
                             name, self->capacity);
    }
    for (*bytes = 0; error == ERROR_OK && *bytes < (size_t)about.st_size;) {
        const ssize_t count = read(fd, self->data + *bytes, (size_t)about.st_size - *bytes);
        error = count <= 0 ? command_fail(self->call, ERROR_IO, "%s: cannot be read", name) : 0;
        *bytes += count > 0 ? (size_t)count : 0;
    }
    close(fd);
    return error;
}

static int load_tftp(struct update *self, const char *address, size_t *bytes) {
    struct command_call call = *self->call;
    const struct tftp_observer observer = commands_observe_transfer(&call);
    struct tftp_address from;
    int error = tftp_parse(address, &from, &self->message);
    error = error != ERROR_OK
                ? error
                : tftp_get(&from, self->data, self->capacity, bytes, &observer, &self->message);
    return error != ERROR_OK ? fail(self, error, "") : ERROR_OK;
}

/// Loads the new image and checks everything that can be checked before writing.
static int load_image(struct update *self, const char *name, const struct slot *slot,
                      const struct slot *other, bool older) {
    const char *board = daemon_of(self->call)->config.board;
    char time[FIT_TIME_BYTES], other_time[FIT_TIME_BYTES];
    size_t bytes = 0;
    int error =
        tftp_is_address(name) ? load_tftp(self, name, &bytes) : load_file(self, name, &bytes);
    if (error != ERROR_OK) {
        return error;
    }
    error = fit_check(self->data, bytes, &self->image, &self->message);
    if (error != ERROR_OK) {
        return fail(self, error, name);
    }
    if (strcmp(self->image.board, board) != 0) {
        return command_fail(self->call, ERROR_REFUSED,
                            "%s: made for the board \"%s\", but this is \"%s\"", name,
                            self->image.board, board);
    }
    if (self->image.bytes > slot->flash.bytes) {
        return command_fail(self->call, ERROR_TOO_LARGE, "%s: %zu bytes, but the slot %s has %u",
                            name, self->image.bytes, slot->flash.name, (unsigned)slot->flash.bytes);
    }
    if (other != NULL && other->valid && !older && self->image.timestamp < other->fit.timestamp) {
        fit_time_text(self->image.timestamp, time);
        fit_time_text(other->fit.timestamp, other_time);
        return command_fail(self->call, ERROR_REFUSED,
                            "%s: made %s, but slot %s has one of %s, which would boot "
                            "(older=yes also erases that)",
                            name, time, other->flash.name, other_time);
    }
    return ERROR_OK;
}

// ---- writing

/// Reads back what was written and compares.
static int verify(struct update *self, const struct flash *flash) {
    uint8_t back[VERIFY_BYTES];
    for (size_t at = 0; at < self->image.bytes;) {
        const size_t left = self->image.bytes - at;
        const size_t bytes = left < sizeof back ? left : sizeof back;
        const int error = flash_read(flash, at, back, bytes, &self->message);
        if (error != ERROR_OK) {
            return error;
        }
        for (size_t i = 0; i < bytes; i++, at++) {
            if (back[i] != self->data[at]) {
                return message_set(&self->message, ERROR_VERIFY,
                                   "%s (%s): differs at 0x%zx after writing: the flash is worn or "
                                   "write-protected",
                                   flash->name, flash->device, at);
            }
        }
        daemon_progress(self->call, "bytes compared", (uint32_t)at, (uint32_t)self->image.bytes);
    }
    return ERROR_OK;
}

/// Erases what the image needs, the first block first.
static int erase(struct update *self, const struct flash *flash) {
    int error = 0;
    for (size_t at = 0; at < self->image.bytes && error == ERROR_OK; at += flash->block_bytes) {
        error = flash_erase(flash, at, flash->block_bytes, &self->message);
        daemon_progress(self->call, "bytes erased", (uint32_t)at, (uint32_t)self->image.bytes);
    }
    return error;
}

/// Writes the image, the first block last. Not cancelled: half of it would be useless.
static int write_image(struct update *self, const struct flash *flash) {
    const size_t block = flash->block_bytes, all = self->image.bytes;
    const size_t first = all < block ? all : block;
    int error = erase(self, flash);
    for (size_t at = first; at < all && error == ERROR_OK; at += block) {
        const size_t bytes = all - at < block ? all - at : block;
        error = flash_write(flash, at, self->data + at, bytes, &self->message);
        daemon_progress(self->call, "bytes written", (uint32_t)at, (uint32_t)all);
    }
    error = error != ERROR_OK ? error : flash_write(flash, 0, self->data, first, &self->message);
    return error != ERROR_OK ? error : verify(self, flash);
}

static int run_image(struct update *self) {
    const struct command_call *call = self->call;
    const size_t index = choose_slot(self);
    struct slot *slot = &self->slots[index];
    struct slot *other = self->slot_count == SLOTS ? &self->slots[1 - index] : NULL;
    const bool older = command_is_set(&call->values[OLDER]);
    int error = load_image(self, call->values[IMAGE].text, slot, other, older);
    if (error != ERROR_OK) {
        return error;
    }
    error = write_image(self, &slot->flash);
    if (error == ERROR_OK && other != NULL && other->valid &&
        self->image.timestamp < other->fit.timestamp) {
        error = flash_erase(&other->flash, 0, other->flash.block_bytes, &self->message);
    }
    if (error != ERROR_OK) {
        return command_fail(call, error, "%.800s (%s)", self->message.text,
                            other != NULL && other->valid
                                ? "the other slot is whole and boots"
                                : "update again before a restart, or boot by TFTP");
    }
    reply_text(call, "written", slot->flash.name);
    reply_text(call, "device", slot->flash.device);
    reply_text(call, "board", self->image.board);
    reply_time(call, self->image.timestamp);
    reply_number(call, "size", (double)self->image.bytes, 0, "bytes");
    reply_text(call, "verified", "yes");
    return ERROR_OK;
}

static int run_update(const struct command_call *call) {
    struct update update = {.call = call};
    int error = open_slots(&update);
    error = error != ERROR_OK ? error : take_memory(&update);
    error = error != ERROR_OK ? error : inspect_slots(&update);
    if (error == ERROR_OK && call->values[IMAGE].given) {
        error = run_image(&update);
    } else if (error == ERROR_OK) {
        reply_slots(&update);
    }
    free(update.data);
    close_slots(&update);
    return error;
}

static const struct command_argument update_arguments[] = {
    {.name = "IMAGE",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = TFTP_NAME_BYTES - 1,
     .optional = true,
     .help = "a file in \"files\", or tftp:HOST/NAME; default: show what the slots contain",
     .candidates = files_candidates_file},
    {.name = "older",
     .kind = COMMAND_FLAG,
     .help = "whether the image may be older than that of the other slot, whose header is then "
             "erased at the end"},
};

static const struct command commands[] = {
    {.name = "update",
     .summary = "write a new image of the board into flash",
     .help = "Checks the sums, the board's name and the size first, then writes the older slot, "
             "reads it back and compares. The image boots at the next restart; a power cut "
             "leaves the other slot whole. A board with one slot boots by TFTP if it was "
             "interrupted.",
     .arguments = update_arguments,
     .argument_count = 2,
     .flags = COMMAND_NO_RIG | COMMAND_LONG,
     .run = run_update},
};

const struct command *commands_update_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}

// SPDX-License-Identifier: Apache-2.0
#include "memory/files.h"

#include <string.h>

#include "console/line/file_blocks.h"
#include "core/base64.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/rig.h"

struct file {
    char name[MEMORY_FILE_NAME_BYTES];  // "DIRECTORY/NAME", or "NAME"; "": no file
    memory_file_read *read;
    const void *source;
    size_t bytes;
};

static struct file files[MEMORY_FILES];

static struct {
    char name[FILE_BLOCKS_SENT_NAME_MAX + 1];
    size_t bytes, have;
    uint32_t crc;
    uint8_t data[MEMORY_SENT_BYTES];
} sent;

void memory_files_put(enum memory_file file, const char *directory, const char *name,
                      memory_file_read *read, const void *source, size_t bytes) {
    struct file *self = &files[file];
    struct command_text text = command_text_begin(self->name, sizeof self->name);
    command_text_join(&text, directory, "/", name);
    INVARIANT(text.length < sizeof self->name - 1);
    self->read = read;
    self->source = source;
    self->bytes = bytes;
}

void memory_files_remove(enum memory_file file) {
    files[file].name[0] = '\0';
}

static void read_sent(const void *source, size_t offset, void *to, size_t bytes) {
    (void)source;
    memcpy(to, sent.data + offset, bytes);
}

static bool is_sent(void) {
    return sent.name[0] != '\0' && sent.have == sent.bytes;
}

const void *memory_files_sent(const char *name, size_t *bytes) {
    if (!is_sent() || strcmp(sent.name, name) != 0) {
        return NULL;
    }
    *bytes = sent.bytes;
    return sent.data;
}

static int refuse(const struct command_call *call, int error, const char *name, const char *why) {
    struct command_text sentence = command_text_begin(call->message, call->message_bytes);
    command_text_add_typed(&sentence, name);
    command_text_join(&sentence, ": ", why);
    return error;
}

static const char *name_of(size_t file) {
    if (file != MEMORY_FILE_SENT) {
        return files[file].name;
    }
    return is_sent() ? sent.name : "";
}

static struct file find(const char *name) {
    for (size_t i = 0; i < MEMORY_FILES; i++) {
        if (name_of(i)[0] != '\0' && strcmp(name_of(i), name) == 0) {
            return i == MEMORY_FILE_SENT ? (struct file){"", read_sent, NULL, sent.bytes}
                                         : files[i];
        }
    }
    return (struct file){.read = NULL};
}

// ---- files

/// What comes after the directory's name and its slash; NULL: it is not in there.
static const char *name_below(const char *name, const char *directory) {
    const size_t length = strlen(directory);
    if (length == 0) {
        return name;
    }
    return strncmp(name, directory, length) == 0 && name[length] == '/' ? name + length + 1 : NULL;
}

/// The first entry after `after` in the order of names, up to its slash; its length, 0: none.
static size_t next_entry(const char *directory, const char *after, size_t *file,
                         const char **name) {
    size_t length = 0;
    for (size_t i = 0; i < MEMORY_FILES; i++) {
        const char *entry = name_below(name_of(i), directory);
        const size_t bytes = entry == NULL ? 0 : strcspn(entry, "/");
        if (bytes == 0 ||
            strncmp(entry, after, bytes > strlen(after) ? bytes : strlen(after)) <= 0 ||
            (length > 0 && strcmp(entry, *name) >= 0)) {
            continue;
        }
        length = bytes;
        *name = entry;
        *file = i;
    }
    return length;
}

static int run_files(const struct command_call *call) {
    const struct command_value *values = call->values;
    const char *directory = values[FILES_DIRECTORY].given ? values[FILES_DIRECTORY].text : "";
    char after[FILES_NAME_MAX + 1] = "";
    const char *name = NULL;
    size_t file = 0, length;
    if (directory[0] != '\0' && next_entry(directory, "", &file, &name) == 0) {
        return refuse(call, ERROR_MISSING, directory, "no such directory");
    }
    if (values[FILES_AFTER].given) {
        strcpy(after, values[FILES_AFTER].text);
    }
    reply_group_begin(call, "files", true);
    while ((length = next_entry(directory, after, &file, &name)) > 0) {
        memcpy(after, name, length);
        after[length] = '\0';
        file_blocks_reply_entry(call, after, name[length] == '/',
                                file == MEMORY_FILE_SENT ? sent.bytes : files[file].bytes);
    }
    reply_group_end(call);
    return ERROR_OK;
}

// ---- fetch

static int run_fetch(const struct command_call *call) {
    static uint8_t block[FILE_BLOCKS_DEFAULT];
    static char text[BASE64_TEXT_BYTES(FILE_BLOCKS_DEFAULT)];
    const struct command_value *values = call->values, *most = &values[FETCH_BYTES];
    const struct file file = find(values[FETCH_NAME].text);
    if (file.read == NULL) {
        return refuse(call, ERROR_MISSING, values[FETCH_NAME].text,
                      "no such file (\"files\" lists them)");
    }
    const size_t max =
        most->given && most->integer < FILE_BLOCKS_DEFAULT ? (size_t)most->integer : sizeof block;
    const bool whole = !values[FETCH_OFFSET].given;
    uint32_t crc = 0;
    uint64_t at = whole ? 0 : (uint64_t)values[FETCH_OFFSET].integer;
    size_t bytes = 0;
    for (; at < file.bytes; at += bytes) {
        bytes = file.bytes - at < max ? file.bytes - (size_t)at : max;
        file.read(file.source, (size_t)at, block, bytes);
        if (!whole) {
            break;
        }
        crc = crc_update(crc, block, bytes);
        if (call->rig->observer.should_stop(call->rig->observer.self)) {
            return ERROR_CANCELLED;
        }
    }
    if (whole) {
        file_blocks_reply_file(call, file.bytes, crc);
    } else {
        file_blocks_reply_block(call, block, bytes, text);
    }
    return ERROR_OK;
}

// ---- send

/// Begins a file, unless it is the one that is coming, or is here.
static int announce(const struct command_call *call, const struct file_blocks_sent *block) {
    const char *name = call->values[SEND_NAME].text;
    const size_t bytes = (size_t)call->values[SEND_SIZE].integer;
    const bool known =
        strcmp(sent.name, name) == 0 && sent.bytes == bytes && sent.crc == block->crc;
    if (!known && block->is_block) {
        return refuse(call, ERROR_MISSING, name, "not announced (\"send NAME SIZE CRC\" first)");
    }
    if (!known && file_blocks_name_fault(name) != NULL) {
        return refuse(call, ERROR_ARGUMENT, name, file_blocks_name_fault(name));
    }
    if (!known && bytes > sizeof sent.data) {
        return refuse(call, ERROR_FULL, name, "too large: a file of at most 393216 bytes fits");
    }
    if (!known) {
        strcpy(sent.name, name);
        sent.bytes = bytes;
        sent.crc = block->crc;
        sent.have = 0;
    }
    return ERROR_OK;
}

static int run_send(const struct command_call *call) {
    static struct file_blocks_sent block;
    const char *name = call->values[SEND_NAME].text;
    int error = file_blocks_take_sent(call, &block);
    error = error != ERROR_OK ? error : announce(call, &block);
    if (error != ERROR_OK) {
        return error;
    }
    const uint64_t offset = block.is_block ? (uint64_t)call->values[SEND_OFFSET].integer : 0;
    if (offset > sent.have || block.bytes > sent.bytes - offset) {
        return refuse(call, ERROR_RANGE, name, "invalid block: it begins behind what is here");
    }
    memcpy(sent.data + offset, block.data, block.bytes);
    sent.have = offset + block.bytes > sent.have ? (size_t)offset + block.bytes : sent.have;
    if (is_sent() && crc_update(0, sent.data, sent.bytes) != sent.crc) {
        sent.name[0] = '\0';
        return refuse(call, ERROR_VERIFY, name,
                      "CRC-32 differs from the announced one: send the file again");
    }
    file_blocks_reply_sent(call, sent.have, is_sent());
    return ERROR_OK;
}

const struct command *memory_files_table(size_t *count) {
    static const struct command commands[] = {
        {.name = "files",
         .summary = "list the files that can be fetched",
         .help = "They are in memory: what was made last, and the file that was sent last.",
         .arguments = file_blocks_files_arguments,
         .argument_count = FILES_ARGUMENTS,
         .flags = COMMAND_NO_RIG | COMMAND_GROUP_FILES | COMMAND_DAILY,
         .run = run_files},
        {.name = "fetch",
         .summary = "read a block of a file (vergence --connect fetches whole files)",
         .help = "The data is in Base64, with its CRC-32 (as in zlib).",
         .arguments = file_blocks_fetch_arguments,
         .argument_count = FETCH_ARGUMENTS,
         .flags = COMMAND_NO_RIG | COMMAND_GROUP_FILES,
         .run = run_fetch},
        {.name = "send",
         .summary = "receive a block of a file (vergence --connect sends whole files)",
         .help = "The file takes the place of the one sent before. It appears once it is complete "
                 "and its CRC-32 (as in zlib) is correct.",
         .arguments = file_blocks_send_arguments,
         .argument_count = SEND_ARGUMENTS,
         .flags = COMMAND_NO_RIG | COMMAND_GROUP_FILES,
         .run = run_send},
    };
    *count = sizeof commands / sizeof commands[0];
    return commands;
}

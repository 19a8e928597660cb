// SPDX-License-Identifier: Apache-2.0
// Lists the instrument's files and transfers them to clients in blocks. A block has an offset, a
// length and a CRC-32, so that a client on a bad line can request it again, and can resume after a
// broken connection.
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc.h"
#include "daemon/base/base64.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"

enum { FILES_LISTED_MAX = 500 };

static void put_entry(const struct command_call *call, int directory, const char *name) {
    struct stat about;
    if (fstatat(directory, name, &about, AT_SYMLINK_NOFOLLOW) != 0) {
        return;
    }
    if (S_ISDIR(about.st_mode) || S_ISREG(about.st_mode)) {
        reply_group_begin(call, NULL, false);
        reply_text(call, S_ISDIR(about.st_mode) ? "directory" : "file", name);
        if (S_ISREG(about.st_mode)) {
            reply_number(call, "size", (double)about.st_size, 0, "bytes");
        }
        reply_group_end(call);
    }
}

static int run_files(const struct command_call *call) {
    const char *after = call->values[1].given ? call->values[1].text : "";
    struct dirent **entries = NULL;
    const int fd = files_open_directory(call, call->values[0].given ? call->values[0].text : "");
    if (fd < 0) {
        return fd;
    }
    const int count = files_list_sorted(fd, &entries);
    if (count < 0) {
        const int number = errno;
        close(fd);
        return files_refuse(call, "files", number);
    }
    int listed = 0;
    reply_group_begin(call, "files", true);
    for (int i = 0; i < count; i++) {
        if (strcmp(entries[i]->d_name, after) > 0 && entries[i]->d_name[0] != '.') {
            if (listed < FILES_LISTED_MAX) {
                put_entry(call, fd, entries[i]->d_name);
            }
            listed++;
        }
        free(entries[i]);
    }
    reply_group_end(call);
    free(entries);
    close(fd);
    if (listed > FILES_LISTED_MAX) {
        reply_text(
            call, "more",
            "the list is incomplete: \"files DIRECTORY after=LAST\" continues after the last name");
    }
    return 0;
}

static void put_crc(const struct command_call *call, uint32_t crc) {
    char text[9];
    snprintf(text, sizeof text, "%08" PRIX32, crc);
    reply_text(call, "crc", text);
}

/// Reports length and CRC-32 of the whole file.
static int describe(const struct command_call *call, int fd) {
    uint64_t size = 0;
    uint32_t crc = 0;
    const int error = files_sum(call, call->values[0].text, fd, &size, &crc);
    if (error == 0) {
        reply_number(call, "size", (double)size, 0, "bytes");
        put_crc(call, crc);
    }
    return error;
}

static int send_block(const struct command_call *call, int fd) {
    static _Thread_local char data[FILES_BLOCK_MAX];
    static _Thread_local char text[BASE64_TEXT_BYTES(FILES_BLOCK_MAX)];
    const int64_t offset = call->values[1].integer;
    const size_t max =
        call->values[2].given ? (size_t)call->values[2].integer : FILES_BLOCK_DEFAULT;
    INVARIANT(max <= sizeof data);
    const ssize_t bytes = pread(fd, data, max, offset);
    if (bytes < 0) {
        return command_fail(call, ERROR_IO, "%s: %s", call->values[0].text, strerror(errno));
    }
    reply_number(call, "offset", (double)offset, 0, "bytes");
    reply_number(call, "bytes", (double)bytes, 0, NULL);
    put_crc(call, crc_update(0, data, (size_t)bytes));
    base64_encode(data, (size_t)bytes, text);
    reply_text(call, "data", text);
    return 0;
}

static int run_fetch(const struct command_call *call) {
    const int fd = files_open(call, call->values[0].text);
    if (fd < 0) {
        return fd;
    }
    const int error = call->values[1].given ? send_block(call, fd) : describe(call, fd);
    close(fd);
    return error;
}

static const struct command_argument files_arguments[] = {
    {.name = "DIRECTORY",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = FILES_NAME_MAX,
     .optional = true,
     .help = "a directory in \"files\"; default: \"files\" itself",
     .candidates = files_candidates_directory},
    {.name = "after",
     .kind = COMMAND_TEXT,
     .value_name = "NAME",
     .min = 1,
     .max = FILES_NAME_MAX,
     .help = "list only names after this one"},
};

static const struct command_argument fetch_arguments[] = {
    {.name = "NAME",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = FILES_NAME_MAX,
     .help = "path of the file below \"files\"",
     .candidates = files_candidates_file},
    {.name = "offset",
     .kind = COMMAND_INTEGER,
     .unit = "bytes",
     .min = 0,
     .max = 1e15,
     .help = "start of the block; default: report length and CRC-32 of the whole file"},
    {.name = "bytes",
     .kind = COMMAND_INTEGER,
     .unit = "bytes",
     .min = 1,
     .max = FILES_BLOCK_MAX,
     .help = "maximum size of the block; default: 3072"},
};

static const struct command commands[] = {
    {.name = "files",
     .summary = "list the files that can be fetched",
     .help =
         "Sessions and other results in the directory \"files\", in the order of names, at most "
         "500.",
     .arguments = files_arguments,
     .argument_count = 2,
     .flags = COMMAND_NO_RIG,
     .run = run_files},
    {.name = "fetch",
     .summary = "read a block of a file (vergence --connect fetches whole files)",
     .help = "The data is in Base64, with its CRC-32 (as in zlib).",
     .arguments = fetch_arguments,
     .argument_count = 3,
     .flags = COMMAND_NO_RIG,
     .run = run_fetch},
};

const struct command *commands_files_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}

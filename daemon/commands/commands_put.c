// SPDX-License-Identifier: Apache-2.0
// Writes files of the instrument to a TFTP server.
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/files/directory_names.h"
#include "daemon/system/tftp.h"

enum { NAME, ADDRESS };

static void report_transfer(void *self, uint64_t done, uint64_t total) {
    const struct command_call *call = self;
    const uint64_t most = total > done ? total : done;
    daemon_progress(call, "bytes transferred", (uint32_t)(done < UINT32_MAX ? done : UINT32_MAX),
                    (uint32_t)(most < UINT32_MAX ? most : UINT32_MAX));
}

static bool should_stop_transfer(void *self) {
    const struct command_call *call = self;
    return daemon_should_stop(call);
}

struct tftp_observer commands_observe_transfer(struct command_call *call) {
    return (struct tftp_observer){report_transfer, should_stop_transfer, call};
}

/// What was written so far.
struct put {
    struct command_call *call;
    struct tftp_address to;  ///< target; without a name, the file keeps its own
    unsigned files;
    uint64_t bytes;
};

/// The name at the server: that of the address, or below it the file's own. False: it is too long.
static bool name_at_server(const struct tftp_address *to, const char *file, bool inside,
                           char name[TFTP_NAME_BYTES]) {
    const size_t length = strlen(to->name);
    const bool folder = length > 0 && to->name[length - 1] == '/';
    const char *slash = strrchr(file, '/');
    const char *own = slash != NULL ? slash + 1 : file;
    const bool whole = length > 0 && !folder && !inside;
    const int bytes = snprintf(name, TFTP_NAME_BYTES, "%s%s%s", to->name,
                               length > 0 && !folder && !whole ? "/" : "", whole ? "" : own);
    return bytes < TFTP_NAME_BYTES;
}

/// Writes one file; below the address's name if it is one of a directory.
static int put_file(struct put *self, const char *name, bool inside) {
    struct command_call *call = self->call;
    const struct tftp_observer observer = commands_observe_transfer(call);
    struct tftp_address to = self->to;
    struct message message;
    struct stat about;
    if (!name_at_server(&self->to, name, inside, to.name)) {
        return command_fail(call, ERROR_ARGUMENT, "%s: the name at the server is too long", name);
    }
    const int fd = files_open(call, name);
    if (fd < 0) {
        return fd;
    }
    int error = fstat(fd, &about) != 0 ? message_set(&message, ERROR_IO, "%s", strerror(errno)) : 0;
    error =
        error != ERROR_OK ? error : tftp_put(&to, fd, (uint64_t)about.st_size, &observer, &message);
    close(fd);
    if (error != ERROR_OK) {
        const bool no_folder = error == ERROR_MISSING && strchr(to.name, '/') != NULL;
        return command_fail(call, error, "%s: %.900s%s", name, message.text,
                            no_folder ? " (TFTP makes no directories: make it at the server)" : "");
    }
    self->files++;
    self->bytes += (uint64_t)about.st_size;
    return ERROR_OK;
}

/// Whether the name is that of a directory.
static bool is_directory(const struct command_call *call, const char *name) {
    const int root = daemon_of(call)->files_fd;
    const int fd = root >= 0 ? files_open_below(root, name) : -1;
    if (fd >= 0) {
        close(fd);
    }
    return fd >= 0;
}

static int put_directory(struct put *self, const char *name) {
    char **names = NULL;
    const int fd = files_open_directory(self->call, name);
    const int count = fd >= 0 ? directory_names(fd, &names) : 0;
    int error = fd < 0 ? fd : ERROR_OK;
    if (count < 0) {
        error = files_refuse(self->call, name, errno);
    }
    for (int i = 0; i < count; i++) {
        char path[2 * FILES_NAME_MAX + 64];
        snprintf(path, sizeof path, "%s/%s", name, names[i]);
        if (error == ERROR_OK && names[i][0] != '.') {
            error = put_file(self, path, true);
        }
        free(names[i]);
    }
    free(names);
    if (fd >= 0) {
        close(fd);
    }
    return error;
}

static int run_put(const struct command_call *call) {
    struct command_call own = *call;
    struct put put = {.call = &own};
    struct message message;
    char name[FILES_NAME_MAX + 1];
    int error = files_need_directory(call);
    if (error == ERROR_OK) {
        error = tftp_parse(call->values[ADDRESS].text, &put.to, &message);
        error = error != ERROR_OK ? command_fail(call, error, "%s", message.text) : 0;
    }
    if (error != ERROR_OK) {
        return error;
    }
    snprintf(name, sizeof name, "%s", call->values[NAME].text);
    for (size_t length = strlen(name); length > 1 && name[length - 1] == '/';) {
        name[--length] = '\0';  // left by completion
    }
    const bool directory = is_directory(call, name);
    if (directory && put.to.name[0] == '\0') {
        snprintf(put.to.name, sizeof put.to.name, "%s", name);
    }
    error = directory ? put_directory(&put, name) : put_file(&put, name, false);
    if (error == ERROR_OK) {
        reply_number(call, "files", put.files, 0, NULL);
        reply_number(call, "bytes", (double)put.bytes, 0, "bytes");
    }
    return error;
}

static const struct command_argument put_arguments[] = {
    {.name = "NAME",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = FILES_NAME_MAX,
     .help = "path below \"files\" of a file, or of a directory with files",
     .candidates = files_candidates_file},
    {.name = "ADDRESS",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = TFTP_NAME_BYTES - 1,
     .help = "tftp:HOST/NAME, where HOST is an IPv4 address; without a name, or with one that ends "
             "in /, the file keeps its own name"},
};

static const struct command commands[] = {
    {.name = "put",
     .summary = "write files to a TFTP server",
     .help = "Example: put surface-scene-1/surface.compact tftp:192.0.2.1/scene.compact. Files of "
             "a directory "
             "are written below its name, for which the directory must exist at the server. "
             "Nothing is authenticated or encrypted; a file that failed may be there in part.",
     .arguments = put_arguments,
     .argument_count = 2,
     .flags = COMMAND_NO_RIG | COMMAND_LONG | COMMAND_GROUP_FILES,
     .run = run_put},
};

const struct command *commands_put_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}

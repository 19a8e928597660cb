// SPDX-License-Identifier: Apache-2.0
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
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
#include "daemon/files/directory_names.h"
#include "daemon/files/file_io.h"
#include "daemon/session/session.h"

enum { FILES_LISTED_MAX = 500, READ_BYTES = 8192 };

int files_refuse(const struct command_call *call, const char *name, int number) {
    return command_fail(call, file_error(number), "%s: %s", name, strerror(number));
}

/// Opens one directory after the other, so that no link in the path is followed.
static int open_below(int root, const char *name, int flags) {
    int directory = openat(root, ".", O_PATH | O_DIRECTORY | O_CLOEXEC);
    while (directory >= 0) {
        const size_t bytes = strcspn(name, "/");
        char part[FILES_NAME_MAX + 1];
        if (bytes == 0 || bytes > FILES_NAME_MAX || name[0] == '.') {
            close(directory);
            errno = ENOENT;
            return -1;
        }
        memcpy(part, name, bytes);
        part[bytes] = '\0';
        const bool last = name[bytes] == '\0';
        const int next =
            openat(directory, part, O_NOFOLLOW | O_CLOEXEC | (last ? flags : O_PATH | O_DIRECTORY));
        const int number = errno;
        close(directory);
        errno = number;
        if (last || next < 0) {
            return next;
        }
        directory = next;
        name += bytes + 1;
    }
    return -1;
}

int files_need_directory(const struct command_call *call) {
    struct daemon *daemon = daemon_of(call);
    struct stat about;
    if (daemon->files_fd < 0) {
        return command_fail(call, ERROR_UNSUPPORTED,
                            "file transfer is disabled: \"files\" is not set");
    }
    if (fstat(daemon->files_fd, &about) == 0 && about.st_nlink > 0) {
        return ERROR_OK;
    }
    // A new directory of the same name is not used.
    return command_fail(call, ERROR_DEVICE,
                        "the directory of files, %s, was removed while the daemon was "
                        "running: restart the daemon, which creates it",
                        daemon->config.files);
}

static int check_name(const struct command_call *call, const char *fault) {
    return fault == NULL ? ERROR_OK : command_fail(call, ERROR_ARGUMENT, "NAME: %s", fault);
}

int files_check_plain(const struct command_call *call, const char *name) {
    return check_name(call, file_blocks_name_fault(name));
}

int files_check_new(const struct command_call *call, const char *name) {
    return check_name(call, file_blocks_new_name_fault(name));
}

void files_name_now(const struct command_call *call, const char *kind, const char *ending,
                    char *name) {
    enum { NAMES_A_SECOND = 1000 };
    const int root = daemon_of(call)->files_fd;
    const time_t now = time(NULL);
    struct tm parts;
    char when[32];
    gmtime_r(&now, &parts);
    strftime(when, sizeof when, "%Y%m%d-%H%M%S", &parts);
    snprintf(name, FILES_NAME_MAX + 1, "%s-%s%s", kind, when, ending);
    for (int i = 2; i < NAMES_A_SECOND && faccessat(root, name, F_OK, AT_SYMLINK_NOFOLLOW) == 0;
         i++) {
        snprintf(name, FILES_NAME_MAX + 1, "%s-%s-%d%s", kind, when, i, ending);
    }
}

int files_open(const struct command_call *call, const char *name) {
    const int error = files_need_directory(call);
    if (error != ERROR_OK) {
        return error;
    }
    // Not blocking: opening a named pipe must not stall the thread.
    const int fd = open_below(daemon_of(call)->files_fd, name, O_RDONLY | O_NONBLOCK);
    struct stat about;
    if (fd < 0) {
        return files_refuse(call, name, errno);
    }
    if (fstat(fd, &about) != 0 || !S_ISREG(about.st_mode)) {
        close(fd);
        return command_fail(call, ERROR_ARGUMENT, "%s: not a regular file", name);
    }
    return fd;
}

int files_sum(const struct command_call *call, const char *name, int fd, uint64_t *size,
              uint32_t *crc) {
    char data[READ_BYTES];
    *size = 0;
    *crc = 0;
    for (;;) {
        const ssize_t bytes = pread(fd, data, sizeof data, (off_t)*size);
        if (bytes < 0) {
            return command_fail(call, ERROR_IO, "%s: %s", name, strerror(errno));
        }
        if (bytes == 0) {
            return ERROR_OK;
        }
        *crc = crc_update(*crc, data, (size_t)bytes);
        *size += (uint64_t)bytes;
        if (daemon_should_stop(call)) {
            return ERROR_CANCELLED;
        }
    }
}

int files_open_below(int root, const char *name) {
    return name[0] == '\0' ? openat(root, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC)
                           : open_below(root, name, O_RDONLY | O_DIRECTORY);
}

DIR *files_list_below(int root, const char *name) {
    return directory_stream(files_open_below(root, name));
}

int files_open_directory(const struct command_call *call, const char *name) {
    const int error = files_need_directory(call);
    if (error != ERROR_OK) {
        return error;
    }
    const int fd = files_open_below(daemon_of(call)->files_fd, name);
    return fd >= 0 ? fd : files_refuse(call, name[0] == '\0' ? "files" : name, errno);
}

int files_write(const struct command_call *call, const char *name, const void *data, size_t bytes) {
    const int error = files_need_directory(call);
    INVARIANT(strchr(name, '/') == NULL && strlen(name) <= FILES_NAME_MAX);
    if (error != ERROR_OK) {
        return error;
    }
    const int full = space_check(call, &(struct free_space){.files_bytes = bytes}, NULL);
    if (full != 0) {
        return full;
    }
    const int root = daemon_of(call)->files_fd;
    return atomic_file_write(root, name, 0640, data, bytes) ? 0 : files_refuse(call, name, errno);
}

// ---- completions of arguments that name files

enum { NAME_BYTES = 2 * FILES_NAME_MAX + 3 };

enum kind { KIND_OTHER, KIND_FILE, KIND_DIRECTORY, KIND_SESSION };

static enum kind kind_of(int directory, const char *name) {
    char index[FILES_NAME_MAX + sizeof SESSION_INDEX_NAME + 1];
    struct stat about;
    if (name[0] == '.' || strlen(name) > FILES_NAME_MAX ||
        fstatat(directory, name, &about, AT_SYMLINK_NOFOLLOW) != 0) {
        return KIND_OTHER;
    }
    if (!S_ISDIR(about.st_mode)) {
        return S_ISREG(about.st_mode) ? KIND_FILE : KIND_OTHER;
    }
    snprintf(index, sizeof index, "%s/" SESSION_INDEX_NAME, name);
    return fstatat(directory, index, &about, AT_SYMLINK_NOFOLLOW) == 0 ? KIND_SESSION
                                                                       : KIND_DIRECTORY;
}

/// Adds an entry of `directory` if it is of the wanted kind; if files are wanted, also a directory,
/// with a / at its end. `prefix`: path of the directory, "" or with a / at its end.
static void add_entry(const struct command_candidates *to, int directory, const char *prefix,
                      const char *entry, enum kind wanted) {
    const enum kind kind = kind_of(directory, entry);
    const bool leads = wanted == KIND_FILE && kind > KIND_FILE;
    if (kind != KIND_OTHER && (leads || kind >= wanted)) {
        char name[NAME_BYTES];
        snprintf(name, sizeof name, "%s%s%s", prefix, entry, leads ? "/" : "");
        to->add(to->self, name);
    }
}

/// Adds the wanted entries of the directory in which the typed word is, in the order of `files`.
static void add_entries(const struct command_candidates *to, enum kind wanted) {
    const struct daemon *daemon = to->context;
    const char *slash = strrchr(to->begun, '/');
    const size_t bytes = slash == NULL ? 0 : (size_t)(slash - to->begun);
    char place[FILES_NAME_MAX + 1];
    char prefix[FILES_NAME_MAX + 2];
    if (bytes > FILES_NAME_MAX || (slash != NULL && wanted == KIND_SESSION)) {
        return;
    }
    memcpy(place, to->begun, bytes);
    place[bytes] = '\0';
    snprintf(prefix, sizeof prefix, "%s%s", place, slash != NULL ? "/" : "");
    const int directory = daemon->files_fd < 0 ? -1 : files_open_below(daemon->files_fd, place);
    char **names = NULL;
    const int count = directory < 0 ? 0 : directory_names(directory, &names);
    for (int i = 0; i < count; i++) {
        add_entry(to, directory, prefix, names[i], wanted);
        free(names[i]);
    }
    free(names);
    if (directory >= 0) {
        close(directory);
    }
}

void files_candidates_file(const struct command_candidates *to) {
    add_entries(to, KIND_FILE);
}

void files_candidates_directory(const struct command_candidates *to) {
    add_entries(to, KIND_DIRECTORY);
}

void files_candidates_session(const struct command_candidates *to) {
    add_entries(to, KIND_SESSION);
}

// ---- the commands

// Lists the instrument's files and transfers them to clients in blocks. A block has an offset, a
// length and a CRC-32, so that a client on a bad line can request it again, and can resume after a
// broken connection.

static void put_entry(const struct command_call *call, int directory, const char *name) {
    struct stat about;
    if (fstatat(directory, name, &about, AT_SYMLINK_NOFOLLOW) != 0) {
        return;
    }
    if (S_ISDIR(about.st_mode) || S_ISREG(about.st_mode)) {
        file_blocks_reply_entry(call, name, S_ISDIR(about.st_mode), (uint64_t)about.st_size);
    }
}

static int run_files(const struct command_call *call) {
    const struct command_value *values = call->values;
    const char *after = values[FILES_AFTER].given ? values[FILES_AFTER].text : "";
    char **names = NULL;
    const int fd = files_open_directory(
        call, values[FILES_DIRECTORY].given ? values[FILES_DIRECTORY].text : "");
    if (fd < 0) {
        return fd;
    }
    const int count = directory_names(fd, &names);
    if (count < 0) {
        const int number = errno;
        close(fd);
        return files_refuse(call, "files", number);
    }
    int listed = 0;
    reply_group_begin(call, "files", true);
    for (int i = 0; i < count; i++) {
        if (strcmp(names[i], after) > 0 && names[i][0] != '.') {
            if (listed < FILES_LISTED_MAX) {
                put_entry(call, fd, names[i]);
            }
            listed++;
        }
        free(names[i]);
    }
    reply_group_end(call);
    free(names);
    close(fd);
    if (listed > FILES_LISTED_MAX) {
        reply_text(
            call, "more",
            "the list is incomplete: \"files DIRECTORY after=LAST\" continues after the last name");
    }
    return 0;
}

/// Reports length and CRC-32 of the whole file.
static int describe(const struct command_call *call, int fd) {
    uint64_t size = 0;
    uint32_t crc = 0;
    const int error = files_sum(call, call->values[FETCH_NAME].text, fd, &size, &crc);
    if (error == ERROR_OK) {
        file_blocks_reply_file(call, size, crc);
    }
    return error;
}

static int send_block(const struct command_call *call, int fd) {
    const struct command_value *most = &call->values[FETCH_BYTES];
    const size_t max = most->given ? (size_t)most->integer : FILE_BLOCKS_DEFAULT;
    char *data = malloc(max + BASE64_TEXT_BYTES(max));
    if (data == NULL) {
        return command_fail(call, ERROR_MEMORY, "out of memory");
    }
    char *text = data + max;
    const ssize_t bytes = pread(fd, data, max, call->values[FETCH_OFFSET].integer);
    if (bytes < 0) {
        free(data);
        return command_fail(call, ERROR_IO, "%s: %s", call->values[FETCH_NAME].text,
                            strerror(errno));
    }
    file_blocks_reply_block(call, data, (size_t)bytes, text);
    free(data);
    return ERROR_OK;
}

static int run_fetch(const struct command_call *call) {
    const int fd = files_open(call, call->values[FETCH_NAME].text);
    if (fd < 0) {
        return fd;
    }
    const int error = call->values[FETCH_OFFSET].given ? send_block(call, fd) : describe(call, fd);
    close(fd);
    return error;
}

static struct command_argument files_arguments[FILES_ARGUMENTS];
static struct command_argument fetch_arguments[FETCH_ARGUMENTS];

static const struct command commands[] = {
    {.name = "files",
     .summary = "list the files that can be fetched",
     .help =
         "Sessions and other results in the directory \"files\", in the order of names, at most "
         "500.",
     .arguments = files_arguments,
     .argument_count = FILES_ARGUMENTS,
     .flags = COMMAND_NO_RIG | COMMAND_GROUP_FILES | COMMAND_DAILY,
     .run = run_files},
    {.name = "fetch",
     .summary = "read a block of a file (vergence --connect fetches whole files)",
     .help = "The data is in Base64, with its CRC-32 (as in zlib).",
     .arguments = fetch_arguments,
     .argument_count = FETCH_ARGUMENTS,
     .flags = COMMAND_NO_RIG | COMMAND_GROUP_FILES,
     .run = run_fetch},
};

const struct command *commands_files_table(size_t *count) {
    memcpy(files_arguments, file_blocks_files_arguments, sizeof files_arguments);
    memcpy(fetch_arguments, file_blocks_fetch_arguments, sizeof fetch_arguments);
    files_arguments[FILES_DIRECTORY].candidates = files_candidates_directory;
    fetch_arguments[FETCH_NAME].candidates = files_candidates_file;
    *count = sizeof commands / sizeof commands[0];
    return commands;
}

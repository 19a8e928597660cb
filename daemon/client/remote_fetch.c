// SPDX-License-Identifier: Apache-2.0
// Fetches a file of the instrument block by block, and all files of a directory.
#include <cjson/cJSON.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base64.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/message.h"
#include "daemon/client/remote.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/file_io.h"

#define PART_END ".part"

enum { BLOCK_SERIAL = 1536, BLOCK_SOCKET = 49152, PATH_BYTES = 4096, NAME_BYTES = 256 };

/// A file on its way.
struct transfer {
    struct remote *remote;
    const char *name;       // name of the file on the instrument
    const char *local;      // path of the file here
    char part[PATH_BYTES];  // path of the partial file
    int fd;
    uint64_t have;  // bytes that an earlier attempt left in `part`
    uint64_t size;
    uint32_t crc;
    uint8_t data[BLOCK_SOCKET];
    char text[BASE64_TEXT_BYTES(BLOCK_SOCKET)];
};

static int invalid(struct message *message) {
    return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
}

static int report_errno(const char *path, struct message *message) {
    return message_set(message, file_error(errno), "%s: %s", path, strerror(errno));
}

static bool read_crc(const struct cJSON *result, uint32_t *crc) {
    char text[16];
    if (!json_member_text(result, "crc", text, sizeof text) || strlen(text) != 8) {
        return false;
    }
    *crc = (uint32_t)strtoul(text, NULL, 16);
    return true;
}

/// Whether an open local file is the instrument's.
static bool is_right(const struct transfer *self, int fd) {
    uint64_t size = 0;
    uint32_t crc = 0;
    return remote_sum_file(fd, &size, &crc) && size == self->size && crc == self->crc;
}

/// Gets length and CRC-32 of the instrument's file.
static int describe(struct transfer *self, struct message *message) {
    const struct cJSON *result = NULL;
    int64_t size = -1;
    const int error =
        remote_call_about(self->remote, "fetch", self->name, &result, message, "%s", "");
    if (error != ERROR_OK) {
        return error;
    }
    if (!json_member_integer(result, "size", &size) || size < 0 || !read_crc(result, &self->crc)) {
        return invalid(message);
    }
    self->size = (uint64_t)size;
    return ERROR_OK;
}

static int refuse_changed(const struct transfer *self, struct message *message) {
    return message_set(message, ERROR_CRC, "%s: changed during the transfer (try again)",
                       self->name);
}

/// Fetches the block at `*offset`, appends it and moves `*offset` behind it.
static int fetch_block(struct transfer *self, uint64_t *offset, struct message *message) {
    const struct cJSON *result = NULL;
    int64_t at = -1;
    uint32_t crc = 0;
    long bytes = -1;
    const int error = remote_call_about(self->remote, "fetch", self->name, &result, message,
                                        " offset=%" PRIu64 " bytes=%d", *offset,
                                        self->remote->line.serial ? BLOCK_SERIAL : BLOCK_SOCKET);
    if (error != ERROR_OK) {
        return error;
    }
    if (json_member_integer(result, "offset", &at) && (uint64_t)at == *offset &&
        read_crc(result, &crc) && json_member_text(result, "data", self->text, sizeof self->text)) {
        bytes = base64_decode(self->text, self->data, sizeof self->data);
    }
    if (bytes <= 0 || crc_update(0, self->data, (size_t)bytes) != crc) {
        return refuse_changed(self, message);
    }
    INVARIANT((size_t)bytes <= sizeof self->data);
    if (lseek(self->fd, (off_t)*offset, SEEK_SET) < 0 ||
        !write_all(self->fd, self->data, (size_t)bytes)) {
        return report_errno(self->part, message);
    }
    *offset += (uint64_t)bytes;
    return ERROR_OK;
}

/// Fetches all from `offset` on.
static int fetch_rest(struct transfer *self, uint64_t offset, struct message *message) {
    int error = ftruncate(self->fd, (off_t)offset) == 0 ? 0 : report_errno(self->part, message);
    while (error == ERROR_OK && offset < self->size) {
        error = fetch_block(self, &offset, message);
        remote_progress(self->remote, self->name, offset, self->size);
    }
    remote_progress(self->remote, "", 0, 0);
    return error;
}

/// Continues an earlier attempt. What turns out to be something else stays as it was.
static int fetch_into_part(struct transfer *self, struct message *message) {
    const int error = self->have <= self->size ? fetch_rest(self, self->have, message) : 0;
    if (error != ERROR_OK || is_right(self, self->fd)) {
        return error;
    }
    if (self->have == 0) {
        return refuse_changed(self, message);
    }
    return ftruncate(self->fd, (off_t)self->have) == 0
               ? message_set(message, ERROR_ARGUMENT, "%s: is not the beginning of %s (remove it)",
                             self->part, self->name)
               : report_errno(self->part, message);
}

/// Whether there is a local file of this name already, which then must be the instrument's:
/// nothing is replaced. `advice`: what to give instead.
static int look_for_local(struct transfer *self, const char *advice, bool *same,
                          struct message *message) {
    struct stat about;
    *same = false;
    if (lstat(self->local, &about) != 0) {
        return ERROR_OK;
    }
    if (stat(self->local, &about) != 0 || !S_ISREG(about.st_mode)) {
        return message_set(
            message, ERROR_ARGUMENT, "%s: exists and is not a file (%s)", self->local,
            S_ISDIR(about.st_mode) ? "it is a directory: give a name in it" : "give another name");
    }
    const int fd = open(self->local, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (fd < 0) {
        return report_errno(self->local, message);
    }
    *same = is_right(self, fd);
    close(fd);
    return *same ? 0
                 : message_set(message, ERROR_ARGUMENT, "%s: exists with other contents (give %s)",
                               self->local, advice);
}

static int open_part(struct transfer *self, struct message *message) {
    // Non-blocking, as it may be something other than a file, which is only inspected.
    const int flags = O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC;
    struct stat about;
    const int length = snprintf(self->part, sizeof self->part, "%s" PART_END, self->local);
    if (length < 0 || (size_t)length >= sizeof self->part) {
        return message_set(message, ERROR_ARGUMENT, "local file name too long");
    }
    self->fd = open(self->part, flags, 0644);
    if (self->fd < 0) {
        return message_set(message, ERROR_IO, "%s: %s", self->part, strerror(errno));
    }
    const bool known = fstat(self->fd, &about) == 0;
    self->have = known ? (uint64_t)about.st_size : 0;
    return known && S_ISREG(about.st_mode)
               ? 0
               : message_set(message, ERROR_ARGUMENT, "%s: exists and is not a file (remove it)",
                             self->part);
}

/// Gives the complete file its name, durably: after a power loss there is no name without its
/// contents, and once success was reported both exist.
static int give_name(const struct transfer *self, struct message *message) {
    return atomic_file_rename(AT_FDCWD, self->fd, self->part, self->local)
               ? 0
               : report_errno(self->local, message);
}

static int fetch(struct transfer *self, struct message *message) {
    bool same = false;
    self->fd = -1;
    int error = describe(self, message);
    error = error != ERROR_OK ? error
                              : look_for_local(self, "another name: fetch NAME FILE, or remove it",
                                               &same, message);
    if (same) {
        return ERROR_OK;
    }
    error = error != ERROR_OK ? error : open_part(self, message);
    error = error != ERROR_OK ? error : fetch_into_part(self, message);
    error = error != ERROR_OK ? error : give_name(self, message);
    if (self->fd >= 0) {
        close(self->fd);
    }
    return error;
}

/// An existing file of a directory must be the instrument's.
static int check_existing(struct transfer *self, struct message *message) {
    const int parent = (int)(strrchr(self->local, '/') - self->local);
    char advice[PATH_BYTES + 32];
    bool same = false;
    snprintf(advice, sizeof advice, "another name than %.*s", parent, self->local);
    const int error = describe(self, message);
    return error != ERROR_OK ? error : look_for_local(self, advice, &same, message);
}

// ---- fetch of a directory

/// The names of a directory's files, sorted.
struct listing {
    char (*names)[NAME_BYTES];
    size_t count;
};

static int add_file(struct listing *list, const char *directory, const struct cJSON *entry,
                    struct message *message) {
    enum { GROWTH = 256 };
    char name[NAME_BYTES];
    if (json_member_text(entry, "directory", name, sizeof name)) {
        return message_set(message, ERROR_UNSUPPORTED,
                           "%s: contains the directory %s (fetch it, and files, by name)",
                           directory, name);
    }
    // No name from the instrument may lead out of the local directory.
    if (!json_member_text(entry, "file", name, sizeof name) || name[0] == '\0' || name[0] == '.' ||
        strchr(name, '/') != NULL ||
        (list->count > 0 && strcmp(name, list->names[list->count - 1]) <= 0)) {
        return invalid(message);
    }
    if (list->count % GROWTH == 0) {
        void *more = realloc(list->names, (list->count + GROWTH) * sizeof *list->names);
        if (more == NULL) {
            return message_set(message, ERROR_MEMORY, "out of memory");
        }
        list->names = more;
    }
    memcpy(list->names[list->count++], name, sizeof name);
    return ERROR_OK;
}

/// Lists all files, as many at a time as vergenced returns.
static int list_files(struct remote *remote, const char *directory, struct listing *list,
                      struct message *message) {
    for (bool more = true; more;) {
        const struct cJSON *result = NULL, *entry = NULL;
        const size_t before = list->count;
        char after[REMOTE_REQUEST_BYTES] = "";
        if (before > 0 && !remote_quote(list->names[before - 1], after)) {
            return invalid(message);
        }
        int error = remote_call_about(remote, "files", directory, &result, message, "%s%s",
                                      before > 0 ? " after=" : "", after);
        cJSON_ArrayForEach(entry, cJSON_GetObjectItemCaseSensitive(result, "files")) {
            error = error != ERROR_OK ? error : add_file(list, directory, entry, message);
        }
        if (error != ERROR_OK) {
            return error;
        }
        more = cJSON_HasObjectItem(result, "more") && list->count > before;
    }
    return ERROR_OK;
}

/// Whether the directory has, or will have, a file of this name.
static bool is_listed(const struct listing *list, const char *name) {
    for (size_t i = 0; i < list->count; i++) {
        const size_t length = strlen(list->names[i]);
        if (strncmp(name, list->names[i], length) == 0 &&
            (name[length] == '\0' || strcmp(name + length, PART_END) == 0)) {
            return true;
        }
    }
    return false;
}

/// Creates the local directory, or accepts one that contains nothing else.
static int make_directory(const struct listing *list, const char *local, struct message *message) {
    if (mkdir(local, 0777) == 0) {
        return ERROR_OK;
    }
    DIR *directory = errno == EEXIST ? opendir(local) : NULL;
    if (directory == NULL) {
        return errno == ENOTDIR ? message_set(message, ERROR_ARGUMENT,
                                              "%s: exists and is not a directory (give another "
                                              "name)",
                                              local)
                                : message_set(message, ERROR_IO, "%s: %s", local, strerror(errno));
    }
    int error = 0;
    for (const struct dirent *entry = readdir(directory); entry != NULL && error == ERROR_OK;
         entry = readdir(directory)) {
        const bool dots = strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0;
        if (!dots && !is_listed(list, entry->d_name)) {
            error = message_set(message, ERROR_ARGUMENT,
                                "%s/%s: exists and is not part of it (give another name than %s)",
                                local, entry->d_name, local);
        }
    }
    closedir(directory);
    return error;
}

/// Waits until the directory's name is on disk, if that can be ensured.
static int sync_name(const char *local, struct message *message) {
    const int fd = open(local, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const bool synced = fd >= 0 && (sync_directory_at(fd, "..") || errno == EACCES);
    const int number = errno;
    if (fd >= 0) {
        close(fd);
    }
    return synced ? 0 : message_set(message, ERROR_IO, "%s: %s", local, strerror(number));
}

/// Checks the existing files of a directory, or fetches those that do not exist.
static int move_files(struct transfer *self, const struct listing *list, bool existing,
                      uint64_t *bytes, struct message *message) {
    char name[PATH_BYTES], local[PATH_BYTES];
    const char *const there = self->name, *const here = self->local;
    struct stat about;
    int error = 0;
    self->name = name;
    self->local = local;
    for (size_t i = 0; i < list->count && error == ERROR_OK; i++) {
        snprintf(name, sizeof name, "%s/%s", there, list->names[i]);
        if (snprintf(local, sizeof local, "%s/%s", here, list->names[i]) >= PATH_BYTES) {
            error = message_set(message, ERROR_ARGUMENT, "%s: name too long", here);
        } else if ((lstat(local, &about) == 0) == existing) {
            error = existing ? check_existing(self, message) : fetch(self, message);
            *bytes += self->size;
        }
    }
    self->name = there;
    self->local = here;
    return error;
}

/// Fetches all files of `self->name`; none if an existing one differs.
static int fetch_directory(struct transfer *self, struct remote_written *written,
                           struct message *message) {
    struct listing list = {NULL, 0};
    int error = list_files(self->remote, self->name, &list, message);
    error = error != ERROR_OK ? error : make_directory(&list, self->local, message);
    error = error != ERROR_OK ? error : sync_name(self->local, message);
    for (int pass = 0; pass < 2 && error == ERROR_OK; pass++) {
        error = move_files(self, &list, pass == 0, &written->bytes, message);
    }
    written->directory = true;
    written->files = list.count;
    free(list.names);
    return error;
}

int remote_fetch(struct remote *remote, const char *name, const char *local,
                 struct remote_written *written, struct message *message) {
    // Completion leaves a slash after a directory.
    char plain[PATH_BYTES];
    size_t length = strlen(name);
    while (length > 1 && name[length - 1] == '/') {
        length--;
    }
    snprintf(plain, sizeof plain, "%.*s", (int)length, name);
    const char *slash = strrchr(plain, '/');
    const char *base = slash != NULL ? slash + 1 : plain;
    *written = (struct remote_written){.bytes = 0};
    snprintf(written->name, sizeof written->name, "%s", local != NULL ? local : base);
    struct transfer *self = malloc(sizeof *self);
    if (self == NULL) {
        return message_set(message, ERROR_MEMORY, "out of memory");
    }
    self->remote = remote;
    self->name = plain;
    self->local = written->name;
    self->size = 0;
    int error = fetch(self, message);
    written->bytes = error == ERROR_OK ? self->size : 0;
    const struct cJSON *names = NULL;
    struct message ignored;
    if (error == ERROR_REFUSED &&
        remote_call_about(remote, "files", plain, &names, &ignored, "%s", "") == 0) {
        error = fetch_directory(self, written, message);
    }
    free(self);
    return error;
}

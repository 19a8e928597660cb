// SPDX-License-Identifier: Apache-2.0
// Fetches all files of a directory of the instrument, such as a session. Files of an earlier
// attempt are compared and kept; other files are left alone.
#include <cjson/cJSON.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/client/remote.h"
#include "daemon/files/file_io.h"

#define PART_END ".part"

enum { NAME_BYTES = 256, PATH_BYTES = 4096, GROWTH = 256 };

struct folder {
    struct remote *remote;
    const char *name, *local;
    char (*files)[NAME_BYTES];  ///< in the order of their names
    size_t count, room;
};

/// No name from the instrument may lead out of the local directory.
static bool is_plain(const char *name) {
    return name[0] != '\0' && name[0] != '.' && strchr(name, '/') == NULL;
}

static int add_file(struct folder *self, const struct cJSON *entry, struct message *message) {
    char name[NAME_BYTES];
    if (json_member_text(entry, "directory", name, sizeof name)) {
        return message_set(message, ERROR_UNSUPPORTED,
                           "%s: contains the directory %s (fetch it, and files, by name)",
                           self->name, name);
    }
    if (!json_member_text(entry, "file", name, sizeof name) || !is_plain(name) ||
        (self->count > 0 && strcmp(name, self->files[self->count - 1]) <= 0)) {
        return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
    }
    if (self->count == self->room) {
        void *more = realloc(self->files, (self->room + GROWTH) * sizeof *self->files);
        if (more == NULL) {
            return message_set(message, ERROR_MEMORY, "out of memory");
        }
        self->files = more;
        self->room += GROWTH;
    }
    memcpy(self->files[self->count++], name, sizeof name);
    return 0;
}

/// Lists all names, as many at a time as vergenced returns.
static int list(struct folder *self, struct message *message) {
    char command[REMOTE_REQUEST_BYTES];
    bool more = true;
    while (more) {
        const struct cJSON *result = NULL;
        const size_t before = self->count;
        const char *last = before > 0 ? self->files[before - 1] : NULL;
        if (!remote_files_command(self->name, last, command)) {
            return message_set(message, ERROR_ARGUMENT, "%s: name too long", self->name);
        }
        int error = remote_call(self->remote, command, &result, message);
        const struct cJSON *entry = NULL;
        cJSON_ArrayForEach(entry, cJSON_GetObjectItemCaseSensitive(result, "files")) {
            error = error != 0 ? error : add_file(self, entry, message);
        }
        if (error != 0) {
            return error;
        }
        more = cJSON_HasObjectItem(result, "more") && self->count > before;
    }
    return 0;
}

/// Whether the directory has, or will have, a file of this name.
static bool is_ours(const struct folder *self, const char *name) {
    const size_t length = strlen(name);
    const size_t end = strlen(PART_END);
    const bool part = length > end && strcmp(name + length - end, PART_END) == 0;
    for (size_t i = 0; i < self->count; i++) {
        const char *ours = self->files[i];
        if (strcmp(name, ours) == 0 ||
            (part && strlen(ours) == length - end && memcmp(name, ours, length - end) == 0)) {
            return true;
        }
    }
    return false;
}

/// Creates the local directory, or accepts one of an earlier attempt.
static int make_local(const struct folder *self, struct message *message) {
    if (mkdir(self->local, 0777) == 0) {
        return 0;
    }
    const int number = errno;
    DIR *directory = number == EEXIST ? opendir(self->local) : NULL;
    if (directory == NULL) {
        return number == EEXIST
                   ? message_set(message, ERROR_ARGUMENT,
                                 "%s: exists and is not a directory (give another name)",
                                 self->local)
                   : message_set(message, ERROR_IO, "%s: %s", self->local, strerror(number));
    }
    int error = 0;
    for (const struct dirent *entry = readdir(directory); entry != NULL && error == 0;
         entry = readdir(directory)) {
        const bool dots = strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0;
        if (!dots && !is_ours(self, entry->d_name)) {
            error = message_set(message, ERROR_ARGUMENT,
                                "%s/%s: exists and is not part of it (give another name than %s)",
                                self->local, entry->d_name, self->local);
        }
    }
    closedir(directory);
    return error;
}

static int open_local(const struct folder *self, struct message *message) {
    const int error = make_local(self, message);
    if (error != 0) {
        return error;
    }
    const int fd = open(self->local, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    // Its name must be on disk too, if that can be ensured.
    const bool synced = fd >= 0 && (sync_directory_at(fd, "..") || errno == EACCES);
    const int number = errno;
    if (fd >= 0) {
        close(fd);
    }
    return synced ? 0 : message_set(message, ERROR_IO, "%s: %s", self->local, strerror(number));
}

/// Makes the remote and local names of a file.
static int make_names(const struct folder *self, size_t at, char *name, char *local,
                      struct message *message) {
    const int there = snprintf(name, PATH_BYTES, "%s/%s", self->name, self->files[at]);
    const int here = snprintf(local, PATH_BYTES, "%s/%s", self->local, self->files[at]);
    return there > 0 && there < PATH_BYTES && here > 0 && here < PATH_BYTES
               ? 0
               : message_set(message, ERROR_ARGUMENT, "%s: name too long", self->local);
}

/// Existing files must be identical; all are compared before anything is fetched.
static int compare(const struct folder *self, struct message *message) {
    char name[PATH_BYTES], local[PATH_BYTES];
    struct stat about;
    int error = 0;
    for (size_t i = 0; i < self->count && error == 0; i++) {
        bool same = true;
        error = make_names(self, i, name, local, message);
        if (error == 0 && lstat(local, &about) == 0) {
            error = remote_fetch_compare(self->remote, name, local, &same, message);
        }
        if (error == 0 && !same) {
            error = message_set(message, ERROR_ARGUMENT,
                                "%s: exists with other contents (give another name than %s)", local,
                                self->local);
        }
    }
    return error;
}

static int fetch_missing(const struct folder *self, uint64_t *bytes, struct message *message) {
    char name[PATH_BYTES], local[PATH_BYTES];
    struct stat about;
    int error = 0;
    for (size_t i = 0; i < self->count && error == 0; i++) {
        uint64_t size = 0;
        error = make_names(self, i, name, local, message);
        if (error == 0 && lstat(local, &about) == 0) {
            size = (uint64_t)about.st_size;
        } else if (error == 0) {
            error = remote_fetch(self->remote, name, local, &size, message);
        }
        *bytes += size;
    }
    return error;
}

int remote_fetch_directory(struct remote *remote, const char *name, const char *local,
                           struct remote_written *written, struct message *message) {
    struct folder self = {.remote = remote, .name = name, .local = local};
    uint64_t bytes = 0;
    int error = list(&self, message);
    error = error != 0 ? error : open_local(&self, message);
    error = error != 0 ? error : compare(&self, message);
    error = error != 0 ? error : fetch_missing(&self, &bytes, message);
    INVARIANT(self.count <= self.room);
    *written = (struct remote_written){
        .name = local, .directory = true, .files = self.count, .bytes = bytes};
    free(self.files);
    return error;
}

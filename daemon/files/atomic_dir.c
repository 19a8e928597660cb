// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/atomic_dir.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/file_io.h"
#include "daemon/files/own_listing.h"
#include "daemon/files/own_remove.h"

#define NOT_OURS " exists and was not written by vergence (move it, or give another directory)"
enum { NAME_ROOM = 300 };

static void parent_of(const char *path, char parent[ATOMIC_DIR_PATH_BYTES]) {
    const char *slash = strrchr(path, '/');
    const size_t length = slash == NULL ? 0 : (size_t)(slash - path);
    if (slash == NULL) {
        strcpy(parent, ".");
    } else if (length == 0) {
        strcpy(parent, "/");
    } else {
        memcpy(parent, path, length);
        parent[length] = '\0';
    }
}

/// Removes a directory of ours: one that is empty, or, under its temporary name, with its files.
static bool remove_directory(const char *path, enum own_proof_kind kind) {
    char parent[ATOMIC_DIR_PATH_BYTES];
    parent_of(path, parent);
    const char *slash = strrchr(path, '/');
    const int fd = open(parent, O_PATH | O_DIRECTORY | O_CLOEXEC);
    const bool removed = fd >= 0 && own_remove(fd, slash == NULL ? path : slash + 1,
                                               &(struct own_proof){.kind = kind});
    if (fd >= 0) {
        close(fd);
    }
    return removed;
}

static void remove_parents(const struct atomic_dir *directory) {
    char path[ATOMIC_DIR_PATH_BYTES], parent[ATOMIC_DIR_PATH_BYTES];
    parent_of(directory->final_path, path);
    for (int i = 0; i < directory->parents_created && remove_directory(path, OWN_EMPTY); i++) {
        parent_of(path, parent);
        strcpy(path, parent);
    }
}

/// Creates the missing parents of the final directory, the highest first.
static int create_parents(struct atomic_dir *directory) {
    char path[ATOMIC_DIR_PATH_BYTES];
    for (char *slash = directory->final_path + 1; (slash = strchr(slash, '/')) != NULL; slash++) {
        const size_t length = (size_t)(slash - directory->final_path);
        memcpy(path, directory->final_path, length);
        path[length] = '\0';
        if (mkdir(path, 0777) == 0) {
            directory->parents_created++;
        } else if (errno != EEXIST) {
            return -1;
        }
    }
    return 0;
}

static int make_work_directory(struct atomic_dir *directory) {
    char parent[ATOMIC_DIR_PATH_BYTES], name[OWN_NAME_BYTES];
    if (directory->exists) {
        strcpy(parent, directory->final_path);
    } else {
        parent_of(directory->final_path, parent);
    }
    const int fd = open(parent, O_PATH | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) {
        return -1;
    }
    own_remove_abandoned(fd, false);
    directory->lock_fd = own_make_directory(fd, name);
    const int number = errno;
    close(fd);
    errno = number;
    if (directory->lock_fd < 0) {
        return -1;
    }
    const int length = snprintf(directory->work_path, ATOMIC_DIR_PATH_BYTES, "%.*s/%s",
                                ATOMIC_DIR_PATH_BYTES - NAME_ROOM, parent, name);
    INVARIANT(length < ATOMIC_DIR_PATH_BYTES);
    return 0;
}

bool atomic_dir_replaces(const char *path, const char *name, const char *input) {
    char target[ATOMIC_DIR_PATH_BYTES + NAME_ROOM];
    struct stat replaced, entry, file;
    const int length = snprintf(target, sizeof target, "%s/%s", path, name);
    // A link in the directory is replaced itself, not its target.
    if (length < 0 || length >= (int)sizeof target || lstat(target, &replaced) != 0) {
        return false;
    }
    return (lstat(input, &entry) == 0 && entry.st_dev == replaced.st_dev &&
            entry.st_ino == replaced.st_ino) ||
           (stat(input, &file) == 0 && file.st_dev == replaced.st_dev &&
            file.st_ino == replaced.st_ino);
}

/// Refuses files in an existing directory that the new ones would replace and that are not ours.
static int check_names(const struct atomic_dir *directory, const char *const *names, int count,
                       struct message *message) {
    const int fd = open(directory->final_path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    struct own_listing listing;
    int error = ERROR_OK;
    if (fd < 0) {
        return ERROR_OK;  // reported when the work begins
    }
    own_listing_read(fd, &listing);
    const struct own_proof proof = own_listing_proof(&listing);
    for (int i = 0; i < count && error == ERROR_OK; i++) {
        if (!own_is_proven(fd, names[i], &proof) && errno == EPERM) {
            error = message_set(message, ERROR_ARGUMENT, "%s/%s" NOT_OURS, directory->final_path,
                                names[i]);
        }
    }
    own_listing_free(&listing);
    close(fd);
    return error;
}

/// Checks what exists under the final name; reported before the work if it can never be a
/// directory.
static int look_at_final_path(struct atomic_dir *directory, const char *path,
                              const char *const *names, int count, struct message *message) {
    struct stat status;
    directory->exists = stat(directory->final_path, &status) == 0;
    const int error_number = errno;
    if (directory->exists) {
        return S_ISDIR(status.st_mode)
                   ? check_names(directory, names, count, message)
                   : message_set(message, ERROR_ARGUMENT,
                                 "%s exists and is not a directory (give another name)", path);
    }
    if (error_number != ENOENT) {
        return message_set(message, ERROR_ARGUMENT, "cannot write to the output directory %s: %s",
                           path, strerror(error_number));
    }
    if (lstat(directory->final_path, &status) == 0) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s is a dangling symbolic link (give another name)", path);
    }
    return ERROR_OK;
}

int atomic_dir_begin(struct atomic_dir *directory, const char *path, const char *const *names,
                     int count, struct message *message) {
    *directory = (struct atomic_dir){.lock_fd = -1};
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/') {
        length--;
    }
    if (length == 0 || length + NAME_ROOM > ATOMIC_DIR_PATH_BYTES) {
        return message_set(message, ERROR_ARGUMENT, "the output directory's name is %s",
                           length == 0 ? "empty" : "too long");
    }
    memcpy(directory->final_path, path, length);
    const int error = look_at_final_path(directory, path, names, count, message);
    if (error != ERROR_OK) {
        return error;
    }
    if ((!directory->exists && create_parents(directory) != 0) ||
        make_work_directory(directory) != 0) {
        const int error_number = errno;
        remove_parents(directory);
        return message_set(message, file_error_is_full(error_number) ? ERROR_FULL : ERROR_ARGUMENT,
                           "cannot write to the output directory %s: %s", path,
                           strerror(error_number));
    }
    return ERROR_OK;
}

void atomic_dir_file_path(const struct atomic_dir *directory, const char *name, char *path) {
    INVARIANT(strchr(name, '/') == NULL && directory->work_path[0] != '\0');
    snprintf(path, ATOMIC_DIR_PATH_BYTES, "%.*s/%.*s", ATOMIC_DIR_PATH_BYTES - NAME_ROOM,
             directory->work_path, NAME_ROOM - 2, name);
}

/// Waits until the file or directory is on disk. False on failure.
static bool sync_path(const char *path) {
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        return false;
    }
    const bool good = sync_file(fd);
    const int error_number = errno;
    close(fd);
    errno = error_number;
    return good;
}

static bool file_exists(const char *path) {
    struct stat status;
    return lstat(path, &status) == 0;
}

static bool sync_files(const struct atomic_dir *directory, const char *const *names, int count,
                       const char **failed) {
    char path[ATOMIC_DIR_PATH_BYTES];
    for (int i = 0; i < count; i++) {
        atomic_dir_file_path(directory, names[i], path);
        *failed = names[i];
        if (file_exists(path) && !sync_path(path)) {
            return false;
        }
    }
    *failed = directory->final_path;
    return sync_path(directory->work_path);
}

/// The files of a set on their way from the hidden directory `from` to `to`.
struct replacing {
    int from, to;
    const char *const *names;
    int count;
    struct own_listing listing;  // files in the directory `to`
    const char *failed;
};

static bool is_there(int directory, const char *name) {
    struct stat status;
    return fstatat(directory, name, &status, AT_SYMLINK_NOFOLLOW) == 0;
}

/// Renames one file into place, or removes its predecessor if there is no such file now.
static bool move_file(struct replacing *self, const char *name) {
    const struct own_proof proof = own_listing_proof(&self->listing);
    self->failed = name;
    if (is_there(self->from, name)) {
        return renameat(self->from, name, self->to, name) == 0;
    }
    return own_remove(self->to, name, &proof) || errno == ENOENT || errno == EPERM;
}

/// Lists the new files, before they are there: their predecessors must be ours.
static bool list_new(struct replacing *self) {
    for (int i = 0; i < self->count; i++) {
        const struct own_proof proof = own_listing_proof(&self->listing);
        self->failed = self->names[i];
        if (is_there(self->from, self->names[i]) &&
            !own_is_proven(self->to, self->names[i], &proof) && errno != ENOENT) {
            errno = EEXIST;
            return false;
        }
    }
    for (int i = 0; i < self->count; i++) {
        if (is_there(self->from, self->names[i]) &&
            !own_listing_set(&self->listing, self->names[i], true)) {
            errno = ENOMEM;
            return false;
        }
    }
    self->failed = OWN_LISTING_NAME;
    return own_listing_write(self->to, &self->listing);
}

/// Drops the names of files that are gone; a failure only leaves them.
static void drop_old(struct replacing *self) {
    bool changed = false;
    for (int i = 0; i < self->count; i++) {
        if (own_listing_has(&self->listing, self->names[i]) &&
            !is_there(self->to, self->names[i])) {
            changed = own_listing_set(&self->listing, self->names[i], false);
        }
    }
    if (changed) {
        own_listing_write(self->to, &self->listing);
    }
}

static bool replace_files(struct replacing *self, const char *closing_name) {
    const struct own_proof proof = own_listing_proof(&self->listing);
    if (!list_new(self)) {
        return false;
    }
    self->failed = closing_name;
    if (!own_remove(self->to, closing_name, &proof) && errno != ENOENT && errno != EPERM) {
        return false;
    }
    for (int i = 0; i < self->count; i++) {
        if (strcmp(self->names[i], closing_name) != 0 && !move_file(self, self->names[i])) {
            return false;
        }
    }
    if (!move_file(self, closing_name)) {
        return false;
    }
    drop_old(self);
    return true;
}

/// Serialises two runs into one directory: the lock makes one whole set replace the other.
static bool replace_alone(const struct atomic_dir *directory, const char *const *names, int count,
                          const char *closing_name, const char **failed) {
    struct replacing self = {
        .from = directory->lock_fd, .names = names, .count = count, .failed = *failed};
    self.to = open(directory->final_path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (self.to < 0) {
        return false;
    }
    flock(self.to, LOCK_EX);
    own_listing_read(self.to, &self.listing);
    const bool good = replace_files(&self, closing_name);
    const int error_number = errno;
    own_listing_free(&self.listing);
    close(self.to);
    *failed = self.failed;
    errno = error_number;
    return good;
}

/// Lists the files of a new directory in it.
static bool list_all(const struct atomic_dir *directory, const char *const *names, int count) {
    struct own_listing listing = {.text = NULL};
    bool good = true;
    for (int i = 0; i < count && good; i++) {
        good = !is_there(directory->lock_fd, names[i]) || own_listing_set(&listing, names[i], true);
    }
    good = good && own_listing_write(directory->lock_fd, &listing);
    own_listing_free(&listing);
    return good;
}

/// Moves the synced files into place; `directory->exists` then says whether it existed.
static bool put_in_place(struct atomic_dir *directory, const char *const *names, int count,
                         const char *closing_name, const char **failed) {
    if (!directory->exists) {
        if (!list_all(directory, names, count)) {
            return false;
        }
        if (rename(directory->work_path, directory->final_path) == 0) {
            return true;
        }
        // Another run has created it meanwhile.
        directory->exists = errno == ENOTEMPTY || errno == EEXIST;
    }
    return directory->exists && replace_alone(directory, names, count, closing_name, failed);
}

int atomic_dir_commit(struct atomic_dir *directory, const char *const *names, int count,
                      const char *closing_name, struct message *message) {
    INVARIANT(directory->work_path[0] != '\0');
    const char *failed = directory->final_path;
    if (!sync_files(directory, names, count, &failed) ||
        !put_in_place(directory, names, count, closing_name, &failed)) {
        const int error_number = errno;
        const bool whole = failed == directory->final_path;
        const int error = file_error_is_full(error_number) ? ERROR_FULL : ERROR_BUFFER;
        const char *slash = whole ? "" : "/", *name = whole ? "" : failed;
        if (error_number == EEXIST) {
            message_set(message, error, "%s%s%s" NOT_OURS, directory->final_path, slash, name);
        } else {
            message_set(message, error, "writing %s%s%s failed: %s", directory->final_path, slash,
                        name, strerror(error_number));
        }
        atomic_dir_abort(directory);
        return error;
    }
    char parent[ATOMIC_DIR_PATH_BYTES];
    parent_of(directory->final_path, parent);
    if (directory->exists) {
        remove_directory(directory->work_path, OWN_TEMPORARY);
    }
    sync_path(directory->exists ? directory->final_path : parent);
    directory->work_path[0] = '\0';
    close(directory->lock_fd);
    return ERROR_OK;
}

void atomic_dir_name_final(const struct atomic_dir *directory, struct message *message) {
    const struct message old = *message;
    const char *at = strstr(old.text, directory->work_path);
    if (directory->work_path[0] != '\0' && at != NULL) {
        message_set(message, 0, "%.*s%s%s", (int)(at - old.text), old.text, directory->final_path,
                    at + strlen(directory->work_path));
    }
}

void atomic_dir_abort(struct atomic_dir *directory) {
    if (directory->work_path[0] == '\0') {
        return;
    }
    remove_directory(directory->work_path, OWN_TEMPORARY);
    remove_parents(directory);
    directory->work_path[0] = '\0';
    close(directory->lock_fd);
}

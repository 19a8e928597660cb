// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/atomic_dir.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/file_io.h"

#define WORK_PREFIX ".vergence-"
enum {
    ABANDONED_AFTER_S = 60,
    NAME_ROOM = 300,
    WORK_NAMES = 1000,  // of one process at a time in one directory
};

/// Removes a directory of plain files; anything else in it stays, and the directory with it.
static void remove_flat_directory(const char *path) {
    DIR *stream = opendir(path);
    if (stream == NULL) {
        return;
    }
    for (struct dirent *entry; (entry = readdir(stream)) != NULL;) {
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) {
            unlinkat(dirfd(stream), entry->d_name, 0);
        }
    }
    closedir(stream);
    rmdir(path);
}

/// Whether the hidden directory's process is gone: it is not locked, and not so new that another
/// process may be about to lock it.
static bool is_abandoned(const char *path) {
    struct stat status;
    const int fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) {
        return false;
    }
    const bool abandoned = fstat(fd, &status) == 0 &&
                           time(NULL) - status.st_mtime > ABANDONED_AFTER_S &&
                           flock(fd, LOCK_EX | LOCK_NB) == 0;
    close(fd);
    return abandoned;
}

static void remove_abandoned(const char *parent) {
    DIR *stream = opendir(parent);
    if (stream == NULL) {
        return;
    }
    for (struct dirent *entry; (entry = readdir(stream)) != NULL;) {
        char path[ATOMIC_DIR_PATH_BYTES + NAME_ROOM];
        if (strncmp(entry->d_name, WORK_PREFIX, strlen(WORK_PREFIX)) == 0) {
            snprintf(path, sizeof path, "%s/%s", parent, entry->d_name);
            if (is_abandoned(path)) {
                remove_flat_directory(path);
            }
        }
    }
    closedir(stream);
}

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

static void remove_parents(const struct atomic_dir *directory) {
    char path[ATOMIC_DIR_PATH_BYTES], parent[ATOMIC_DIR_PATH_BYTES];
    parent_of(directory->final_path, path);
    for (int i = 0; i < directory->parents_created && rmdir(path) == 0; i++) {
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
    char parent[ATOMIC_DIR_PATH_BYTES];
    if (directory->exists) {
        strcpy(parent, directory->final_path);
    } else {
        parent_of(directory->final_path, parent);
    }
    remove_abandoned(parent);
    char path[ATOMIC_DIR_PATH_BYTES + NAME_ROOM];
    int made = -1;
    // With mkdir: the kernel applies the umask, which cannot be read without changing it for all
    // threads.
    for (int i = 0; made != 0 && i < WORK_NAMES; i++) {
        snprintf(path, sizeof path, "%s/" WORK_PREFIX "%ld-%d", parent, (long)getpid(), i);
        made = mkdir(path, 0777);
        if (made != 0 && errno != EEXIST) {
            break;
        }
    }
    if (made != 0) {
        return -1;
    }
    INVARIANT(strlen(path) < ATOMIC_DIR_PATH_BYTES);
    strcpy(directory->work_path, path);
    directory->lock_fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory->lock_fd >= 0) {
        flock(directory->lock_fd, LOCK_EX | LOCK_NB);
    }
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

/// Checks what exists under the final name; reported before the work if it can never be a
/// directory.
static int look_at_final_path(struct atomic_dir *directory, const char *path,
                              struct message *message) {
    struct stat status;
    directory->exists = stat(directory->final_path, &status) == 0;
    const int error_number = errno;
    if (directory->exists) {
        return S_ISDIR(status.st_mode)
                   ? ERROR_OK
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

int atomic_dir_begin(struct atomic_dir *directory, const char *path, struct message *message) {
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
    const int error = look_at_final_path(directory, path, message);
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

static void final_file_path(const struct atomic_dir *directory, const char *name, char *path) {
    snprintf(path, ATOMIC_DIR_PATH_BYTES, "%.*s/%.*s", ATOMIC_DIR_PATH_BYTES - NAME_ROOM,
             directory->final_path, NAME_ROOM - 2, name);
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

/// Renames one file into place, or removes its predecessor if there is no such file now.
static bool move_file(const struct atomic_dir *directory, const char *name) {
    char from[ATOMIC_DIR_PATH_BYTES], to[ATOMIC_DIR_PATH_BYTES];
    atomic_dir_file_path(directory, name, from);
    final_file_path(directory, name, to);
    if (file_exists(from)) {
        return rename(from, to) == 0;
    }
    return unlink(to) == 0 || errno == ENOENT;
}

static bool replace_files(const struct atomic_dir *directory, const char *const *names, int count,
                          const char *closing_name, const char **failed) {
    char path[ATOMIC_DIR_PATH_BYTES];
    struct stat status;
    // Only files and links are replaced, not directories or devices: checked before anything is
    // changed.
    for (int i = 0; i < count; i++) {
        final_file_path(directory, names[i], path);
        if (lstat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISLNK(status.st_mode)) {
            *failed = names[i];
            errno = S_ISDIR(status.st_mode) ? EISDIR : EEXIST;
            return false;
        }
    }
    final_file_path(directory, closing_name, path);
    *failed = closing_name;
    if (unlink(path) != 0 && errno != ENOENT) {
        return false;
    }
    for (int i = 0; i < count; i++) {
        *failed = names[i];
        if (strcmp(names[i], closing_name) != 0 && !move_file(directory, names[i])) {
            return false;
        }
    }
    *failed = closing_name;
    return move_file(directory, closing_name);
}

/// Serialises two runs into one directory: the lock makes one whole set replace the other.
static bool replace_alone(const struct atomic_dir *directory, const char *const *names, int count,
                          const char *closing_name, const char **failed) {
    const int fd = open(directory->final_path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) {
        return false;
    }
    flock(fd, LOCK_EX);
    const bool good = replace_files(directory, names, count, closing_name, failed);
    const int error_number = errno;
    close(fd);
    errno = error_number;
    return good;
}

/// Moves the synced files into place; `directory->exists` then says whether it existed.
static bool put_in_place(struct atomic_dir *directory, const char *const *names, int count,
                         const char *closing_name, const char **failed) {
    if (!directory->exists) {
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
        message_set(message, error, "writing %s%s%s failed: %s", directory->final_path,
                    whole ? "" : "/", whole ? "" : failed,
                    error_number == EEXIST ? "exists and is not a file" : strerror(error_number));
        atomic_dir_abort(directory);
        return error;
    }
    char parent[ATOMIC_DIR_PATH_BYTES];
    parent_of(directory->final_path, parent);
    if (directory->exists) {
        remove_flat_directory(directory->work_path);
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
    remove_flat_directory(directory->work_path);
    remove_parents(directory);
    directory->work_path[0] = '\0';
    close(directory->lock_fd);
}

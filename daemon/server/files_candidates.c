// SPDX-License-Identifier: Apache-2.0
// What may be typed for a file of the instrument's.
#include <dirent.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "daemon/server/files.h"
#include "daemon/server/surroundings.h"
#include "daemon/session.h"

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

/// The entries of the directory that the word begins with: those wanted, and where they are files,
/// the directories that lead to some.
static void add_entries(const struct command_candidates *to, enum kind wanted) {
    const struct surroundings *around = to->surroundings;
    const char *slash = strrchr(to->begun, '/');
    const size_t bytes = slash == NULL ? 0 : (size_t)(slash - to->begun);
    char place[FILES_NAME_MAX + 1];
    if (bytes > FILES_NAME_MAX || (slash != NULL && wanted == KIND_SESSION)) {
        return;
    }
    memcpy(place, to->begun, bytes);
    place[bytes] = '\0';
    DIR *directory = around->files_fd < 0 ? NULL : files_list_below(around->files_fd, place);
    if (directory == NULL) {
        return;
    }
    for (const struct dirent *entry = readdir(directory); entry != NULL;
         entry = readdir(directory)) {
        const enum kind kind = kind_of(dirfd(directory), entry->d_name);
        const bool leads = wanted == KIND_FILE && kind > KIND_FILE;
        if (kind == KIND_OTHER || (!leads && kind < wanted)) {
            continue;
        }
        char name[NAME_BYTES];
        snprintf(name, sizeof name, "%s%s%s%s", place, slash != NULL ? "/" : "", entry->d_name,
                 leads ? "/" : "");
        to->add(to->self, name);
    }
    closedir(directory);
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

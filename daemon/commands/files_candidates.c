// SPDX-License-Identifier: Apache-2.0
// Completions of arguments that name the instrument's files.
#include <dirent.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/session/session.h"

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
    struct dirent **entries = NULL;
    const int count = directory < 0 ? 0 : files_list_sorted(directory, &entries);
    for (int i = 0; i < count; i++) {
        add_entry(to, directory, prefix, entries[i]->d_name, wanted);
        free(entries[i]);
    }
    free(entries);
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

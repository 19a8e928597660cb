// SPDX-License-Identifier: Apache-2.0
// Removes what this product has written into the instrument's files: a file, or a directory that is
// a session or a surface. What else is in such a directory stays.
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/files/directory_names.h"
#include "daemon/files/own_listing.h"
#include "daemon/session/session_files.h"

/// One removal, and its job for the disk writer.
struct removal {
    const struct command_call *call;
    bool ours;                       // the directory is a session or a surface
    int left;                        // files that stay
    char first[FILES_NAME_MAX + 1];  // one of them
    int error;
};

/// Removes what a result wrote (own_listing.h).
static bool remove_result(int directory) {
    struct own_listing listing;
    own_listing_read(directory, &listing);
    const bool any = listing.text != NULL;
    const struct own_proof proof = own_listing_proof(&listing);
    char **names = NULL;
    const int count = any ? directory_names(directory, &names) : 0;
    for (int i = 0; i < count; i++) {
        if (own_remove(directory, names[i], &proof)) {
            own_listing_set(&listing, names[i], false);
        }
        free(names[i]);
    }
    free(names);
    if (any) {
        own_remove_abandoned(directory, false);
        own_listing_forget(directory);
    }
    own_listing_free(&listing);
    return any;
}

static bool remove_session(int directory) {
    struct session_files files;
    const bool any = session_files_read(&files, directory);
    if (any) {
        session_files_remove(&files);
        session_files_free(&files);
    }
    return any;
}

static void count_left(struct removal *self, int directory) {
    char **names = NULL;
    const int count = directory_names(directory, &names);
    for (int i = 0; i < count; i++) {
        if (self->left++ == 0) {
            snprintf(self->first, sizeof self->first, "%.*s", FILES_NAME_MAX, names[i]);
        }
        free(names[i]);
    }
    free(names);
}

/// Removes a directory with its files. 0 or an errno.
static int remove_directory(struct removal *self, int root, const char *name) {
    const int directory = files_open_below(root, name);
    if (directory < 0) {
        return errno;
    }
    const bool session = remove_session(directory);
    self->ours = remove_result(directory) || session;
    count_left(self, directory);
    close(directory);
    const struct own_proof empty = {.kind = OWN_EMPTY};
    return self->left > 0 || own_remove(root, name, &empty) ? 0 : errno;
}

static void remove_named(void *cookie) {
    struct removal *self = cookie;
    const char *name = self->call->values[0].text;
    const int root = daemon_of(self->call)->files_fd;
    struct stat about;
    int number = 0;
    if (fstatat(root, name, &about, AT_SYMLINK_NOFOLLOW) == 0 && S_ISDIR(about.st_mode)) {
        number = remove_directory(self, root, name);
    } else if (!own_remove(root, name, &(struct own_proof){.kind = OWN_ASKED})) {
        number = errno;
    }
    self->error = number == 0 ? 0 : files_refuse(self->call, name, number);
}

static int run_remove(const struct command_call *call) {
    struct daemon *daemon = daemon_of(call);
    struct removal removal = {.call = call};
    const char *name = call->values[0].text;
    int error = files_need_directory(call);
    error = error != ERROR_OK ? error : files_check_plain(call, name);
    if (error != ERROR_OK) {
        return error;
    }
    if (daemon->session.recording && strcmp(daemon->session.name, name) == 0) {
        return command_fail(call, ERROR_BUSY, "%s: is being recorded (\"record stop\" first)",
                            name);
    }
    disk_writer_run(&daemon->disk_writer, remove_named, &removal);
    if (removal.error == ERROR_OK && removal.left > 0 && !removal.ours) {
        return command_fail(call, ERROR_REFUSED,
                            "%s: no session and no surface of this instrument (remove it by other "
                            "means)",
                            name);
    }
    if (removal.error == ERROR_OK && removal.left > 0) {
        char text[2 * FILES_NAME_MAX];
        snprintf(text, sizeof text, "%s/%s%s", name, removal.first,
                 removal.left > 1 ? " and others" : "");
        reply_number(call, "left", removal.left, 0, "files");
        reply_text(call, "not_written_by_vergence", text);
    }
    return removal.error;
}

static const struct command_argument remove_arguments[] = {
    {.name = "NAME",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = FILES_NAME_MAX,
     .help = "a file, a session or a surface in \"files\"",
     .candidates = files_candidates_file},
};

static const struct command commands[] = {
    {.name = "remove",
     .summary = "remove a file, a session or a surface",
     .help = "What is removed cannot be recovered. In the directory of a session or a surface, "
             "files that this program did not write stay, and are reported. The session being "
             "recorded is rejected.",
     .arguments = remove_arguments,
     .argument_count = 1,
     .flags = COMMAND_UNRECORDED | COMMAND_GROUP_FILES,
     .run = run_remove},
};

const struct command *commands_remove_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}

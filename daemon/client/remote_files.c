// SPDX-License-Identifier: Apache-2.0
// Commands that move whole files, which the client carries out itself.
#include <stdio.h>
#include <string.h>

#include "console/command.h"
#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/client/remote.h"

/// The local name of a file without its directories.
static const char *base_name(const char *name) {
    const char *slash = strrchr(name, '/');
    return slash != NULL ? slash + 1 : name;
}

/// A name without trailing slashes, which completion leaves after a directory.
static const char *without_end(const char *name, char *text) {
    size_t length = strlen(name);
    while (length > 1 && name[length - 1] == '/') {
        length--;
    }
    memcpy(text, name, length);
    text[length] = '\0';
    return text;
}

/// Whether the instrument has a directory of this name.
static bool is_directory(struct remote *self, const char *name) {
    char command[REMOTE_REQUEST_BYTES];
    const struct cJSON *result = NULL;
    struct message ignored;
    return remote_files_command(name, NULL, command) &&
           remote_call(self, command, &result, &ignored) == 0;
}

/// Carries out "fetch" or "send"; `other` is the second name.
static int move_file(struct remote *self, bool fetch, const char *name, const char *other,
                     remote_show *show, void *cookie, struct message *message) {
    struct remote_written written = {.name = other};
    int error = fetch ? remote_fetch(self, name, other, &written.bytes, message)
                      : remote_send(self, name, other, &written.bytes, message);
    if (fetch && error == ERROR_REFUSED && is_directory(self, name)) {
        error = remote_fetch_directory(self, name, other, &written, message);
    }
    if (error == 0) {
        remote_show_written(self, show, cookie, &written);
    }
    return error;
}

/// What a line does with whole files.
enum transfer { NO_TRANSFER, FETCH, SEND, SNAPSHOT };

static enum transfer transfer_of(const struct command_words *words) {
    static const struct command_parser parser = {.dashes = ""};
    const char *const *word = words->word;
    const size_t count = words->count;
    if (count > 0 && strcmp(word[0], "snapshot") == 0) {
        return SNAPSHOT;
    }
    if (count < 2 || count > 3) {
        return NO_TRANSFER;
    }
    if (strcmp(word[0], "send") == 0) {
        return SEND;
    }
    // "fetch NAME offset=0" is for the instrument.
    const bool block =
        count == 3 && (words->quoted >> 2 & 1) == 0 && command_is_option(&parser, word[2]);
    return !block && strcmp(word[0], "fetch") == 0 ? FETCH : NO_TRANSFER;
}

/// Shows an error as an answer in JSON.
static void show_failure(struct remote *self, remote_show *show, void *cookie, int error,
                         const struct message *message) {
    if (error == ERROR_REFUSED && self->refused) {
        char rejection[MESSAGE_BYTES + 8];
        snprintf(rejection, sizeof rejection, "ERR %s", message->text);  // from the daemon
        remote_show_rejection(self, show, cookie, rejection);
    } else if (error < 0) {
        remote_show_error(self, show, cookie, error, message->text);
    }
}

int remote_files(struct remote *self, const char *line, remote_show *show, void *cookie, int *error,
                 struct message *message) {
    char storage[COMMAND_LINE_MAX + 1];
    struct command_words words;
    const char *why = NULL;
    const enum transfer transfer =
        command_words_split(line, storage, &words, &why) == 0 ? transfer_of(&words) : NO_TRANSFER;
    if (transfer == NO_TRANSFER) {
        return 0;
    }
    self->refused = false;
    if (transfer == SNAPSHOT) {
        *error = remote_snapshot(self, line, show, cookie, message);
    } else {
        char plain[COMMAND_LINE_MAX + 1];
        const bool fetch = transfer == FETCH;
        const char *name = fetch ? without_end(words.word[1], plain) : words.word[1];
        const char *other = words.count == 3 ? words.word[2] : base_name(name);
        *error = move_file(self, fetch, name, other, show, cookie, message);
    }
    if (self->json) {
        show_failure(self, show, cookie, *error, message);
    }
    return 1;
}

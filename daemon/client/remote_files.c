// SPDX-License-Identifier: Apache-2.0
// Commands that move whole files, which the client carries out itself: fetch, send, and those that
// make files for the user. A file that was moved in part is continued.
#include <cjson/cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "console/command.h"
#include "core/base64.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/message.h"
#include "daemon/client/remote.h"
#include "daemon/files/file_io.h"

enum {
    BLOCK_SENT = 288,  // commands are limited to 512 characters
    SEND_TRIES = 2,
    NAME_BYTES = 256,
    NUMBERS_MAX = 1000,
    MADE_FILES = 2  // maximum number of files that one command makes
};

/// A file being sent.
struct sending {
    struct remote *remote;
    const char *name;   // name of the file on the instrument
    const char *local;  // path of the file here
    int fd;
    uint64_t size;
    uint32_t crc;
    uint64_t have;  // bytes that the instrument has
    bool whole;     // it has all of them
};

static int invalid(struct message *message) {
    return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
}

static int report_errno(const char *path, struct message *message) {
    return message_set(message, file_error(errno), "%s: %s", path, strerror(errno));
}

/// Sends a line about the file and reads how much of it the instrument has.
static int announce(struct sending *self, const char *block, struct message *message) {
    const struct cJSON *result = NULL;
    char whole[8] = "";
    int64_t have = -1;
    const int error =
        remote_call_about(self->remote, "send", self->name, &result, message,
                          " %" PRIu64 " %08" PRIX32 "%s", self->size, self->crc, block);
    if (error != ERROR_OK) {
        return error;
    }
    if (!json_member_integer(result, "have", &have) || have < 0 || (uint64_t)have > self->size ||
        !json_member_text(result, "whole", whole, sizeof whole)) {
        return invalid(message);
    }
    self->have = (uint64_t)have;
    self->whole = strcmp(whole, "yes") == 0;
    return ERROR_OK;
}

static int send_block(struct sending *self, struct message *message) {
    uint8_t data[BLOCK_SENT];
    char text[BASE64_TEXT_BYTES(BLOCK_SENT)];
    char block[sizeof text + 64];
    const uint64_t offset = self->have;
    const ssize_t bytes = pread(self->fd, data, sizeof data, (off_t)offset);
    if (bytes <= 0) {
        return message_set(message, ERROR_IO, "%s: %s", self->local,
                           bytes == 0 ? "changed during the transfer" : strerror(errno));
    }
    base64_encode(data, (size_t)bytes, text);
    snprintf(block, sizeof block, " offset=%" PRIu64 " block-crc=%08" PRIX32 " data=%s", offset,
             crc_update(0, data, (size_t)bytes), text);
    const int error = announce(self, block, message);
    return error == ERROR_OK && !self->whole && self->have <= offset ? invalid(message) : error;
}

/// Opens the file to be sent and sums it.
static int open_sent(struct sending *self, struct message *message) {
    struct stat about;
    self->fd = open(self->local, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (self->fd < 0) {
        return report_errno(self->local, message);
    }
    int error = 0;
    if (fstat(self->fd, &about) != 0 || !S_ISREG(about.st_mode)) {
        error = message_set(message, ERROR_ARGUMENT, "%s: not a file", self->local);
    } else if (!remote_sum_file(self->fd, &self->size, &self->crc)) {
        error = report_errno(self->local, message);
    }
    if (error != ERROR_OK) {
        close(self->fd);
    }
    return error;
}

/// Sends the file `local` as `name`; NULL: under its own name.
static int send_file(struct remote *remote, const char *local, const char *name,
                     struct remote_written *written, struct message *message) {
    const char *slash = strrchr(local, '/');
    const char *local_name = slash != NULL ? slash + 1 : local;
    struct sending self = {
        .remote = remote, .local = local, .name = name != NULL ? name : local_name};
    int error = open_sent(&self, message);
    if (error != ERROR_OK) {
        return error;
    }
    bool again = true;
    // Data of an earlier attempt may be damaged: the instrument reports that at the end and
    // discards it.
    for (int i = 0; i < SEND_TRIES && again; i++) {
        error = announce(&self, "", message);
        const bool resumed = error != ERROR_OK || self.have > 0;
        while (error == ERROR_OK && !self.whole) {
            error = send_block(&self, message);
            remote_progress(remote, local, self.have, self.size);
        }
        remote_progress(remote, "", 0, 0);
        again = error == ERROR_REFUSED && resumed;
    }
    INVARIANT(error != ERROR_OK || self.whole);
    close(self.fd);
    snprintf(written->name, sizeof written->name, "%s", self.name);
    written->bytes = self.size;
    return error;
}

/// A command's answer, and the files that it made for the user. They are written here under the
/// same names, or with a number appended if those exist: an instrument without a valid clock
/// repeats names.
struct made {
    remote_show *show;
    void *cookie;
    char name[MADE_FILES][NAME_BYTES];
    char local[MADE_FILES][NAME_BYTES + 8];
    struct cJSON *answer;  // the whole answer as parsed JSON
};

/// Members of the answer with their names.
static const char *const made_members[MADE_FILES] = {"file", "table"};

/// Whether it is a name as the instrument chooses it: no other file may be fetched or written.
static bool is_made(const char *name) {
    static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789-.";
    const char *ending = strrchr(name, '.');
    return ending != NULL && ending != name && name[0] != '.' &&
           name[strspn(name, letters)] == '\0' &&
           (strcmp(ending, ".png") == 0 || strcmp(ending, ".svg") == 0 ||
            strcmp(ending, ".csv") == 0);
}

/// Shows the answer except for the names and its end.
static void hold_back(struct remote *self, void *cookie, const char *text) {
    struct made *made = cookie;
    char event[32];
    if (self->json) {
        struct cJSON *all = json_parse(text);
        if (!json_member_text(all, "event", event, sizeof event) && json_member_true(all, "ok")) {
            cJSON_Delete(made->answer);
            made->answer = all;
            return;
        }
        cJSON_Delete(all);
    }
    for (int i = 0; i < MADE_FILES && !self->json; i++) {
        const size_t length = strlen(made_members[i]);
        if (strncmp(text, made_members[i], length) == 0 && strncmp(text + length, ": ", 2) == 0) {
            snprintf(made->name[i], sizeof made->name[i], "%s", text + length + 2);
            return;
        }
    }
    if (self->json || strcmp(text, "OK") != 0) {
        made->show(self, made->cookie, text);
    }
}

void remote_free_name(const char *name, char *local, size_t bytes) {
    const char *ending = strrchr(name, '.');
    struct stat about;
    snprintf(local, bytes, "%s", name);
    for (int i = 2; i < NUMBERS_MAX && lstat(local, &about) == 0; i++) {
        snprintf(local, bytes, "%.*s-%d%s", (int)(ending - name), name, i, ending);
    }
}

int remote_fetch_result(struct remote *self, const char *name, const char *local, const char *then,
                        struct remote_written *written, struct message *message) {
    const char *const here = local != NULL ? local : "";
    const int error = remote_fetch(self, name, local, written, message);
    if (error == ERROR_OK || error == ERROR_REFUSED) {
        return error;
    }
    const struct message cause = *message;
    return then != NULL
               ? message_set(message, error,
                             "%s; %s is complete on the instrument: \"fetch %s%s%s\", then "
                             "\"vergence %s %s\"",
                             cause.text, name, name, local != NULL ? " " : "", here, then,
                             local != NULL ? local : name)
               : message_set(message, error, "%s; %s is complete on the instrument: \"fetch %s\"",
                             cause.text, name, name);
}

/// Fetches a file under a name that is free here.
static int fetch_made(struct remote *self, const char *name, char local[NAME_BYTES + 8],
                      struct remote_written *written, struct message *message) {
    if (!is_made(name)) {
        return invalid(message);
    }
    remote_free_name(name, local, NAME_BYTES + 8);
    return remote_fetch_result(self, name, local, NULL, written, message);
}

/// Fetches and shows all that was made. The answer must name at least one file.
static int fetch_all(struct remote *self, struct made *made, struct message *message) {
    static struct remote_written written;
    struct cJSON *result = cJSON_GetObjectItemCaseSensitive(made->answer, "result");
    for (int i = 0; i < MADE_FILES; i++) {
        char *name = made->name[i];
        json_member_text(result, made_members[i], name, NAME_BYTES);
        if (name[0] == '\0' && i > 0) {
            continue;
        }
        const int error = fetch_made(self, name, made->local[i], &written, message);
        if (error != ERROR_OK) {
            return error;
        }
        if (self->json) {
            cJSON_ReplaceItemInObject(result, made_members[i], cJSON_CreateString(made->local[i]));
        } else {
            remote_show_written(self, made->show, made->cookie, &written);
        }
    }
    return ERROR_OK;
}

/// Runs a line that makes files, and fetches them. As remote_ask: 1 if the answer is ERR.
static int make(struct remote *self, const char *line, remote_show *show, void *cookie,
                struct message *message) {
    struct made made = {.show = show, .cookie = cookie};
    int error = remote_ask(self, line, hold_back, &made, message);
    error = error == ERROR_OK ? fetch_all(self, &made, message) : error;
    if (error == ERROR_OK) {
        char *text = self->json ? cJSON_PrintUnformatted(made.answer) : NULL;
        show(self, cookie, text != NULL ? text : "OK");
        cJSON_free(text);
    }
    cJSON_Delete(made.answer);
    return error;
}

enum file_command { NO_FILE_COMMAND, MAKE, MEASURE, SEND, FETCH };

/// Whether it is a command whose surface is made here: `measure NAME`, and `reconstruct` without
/// its option files, in any form.
static bool makes_surface(const struct remote *remote, const struct command_words *words) {
    if (strcmp(words->word[0], "measure") == 0) {
        return words->count > 1;
    }
    bool made = remote->reconstruct != NULL && strcmp(words->word[0], "reconstruct") == 0;
    for (size_t i = 1; i < words->count; i++) {
        const char *name = words->word[i] + strspn(words->word[i], "-");
        made = made && !(strncmp(name, "files", 5) == 0 && (name[5] == '\0' || name[5] == '='));
    }
    return made;
}

/// Which of the client's own commands it is.
static enum file_command command_of(const struct remote *remote,
                                    const struct command_words *words) {
    static const struct command_parser parser = {.dashes = ""};
    if (strcmp(words->word[0], "view") == 0 || strcmp(words->word[0], "focus-curve") == 0) {
        return MAKE;
    }
    if (makes_surface(remote, words)) {
        return MEASURE;
    }
    // "fetch NAME offset=0" is for the instrument.
    const bool block = words->count == 3 && (words->quoted >> 2 & 1) == 0 &&
                       command_is_option(&parser, words->word[2]);
    if (words->count < 2 || words->count > 3 || block) {
        return NO_FILE_COMMAND;
    }
    if (strcmp(words->word[0], "send") == 0) {
        return SEND;
    }
    return strcmp(words->word[0], "fetch") == 0 ? FETCH : NO_FILE_COMMAND;
}

/// Shows an error. Returns the one to end with.
static int show_error(struct remote *self, remote_show *show, void *cookie, int error,
                      const struct message *message) {
    if (error == ERROR_REFUSED && self->refused && self->json) {
        char rejection[MESSAGE_BYTES + 8];
        snprintf(rejection, sizeof rejection, "ERR %s", message->text);  // the daemon's message
        remote_show_rejection(self, show, cookie, rejection);
    } else if (self->json && error < 0) {
        remote_show_error(self, show, cookie, error, message->text);
    }
    return error;
}

int remote_files(struct remote *self, const char *line, remote_show *show, void *cookie, int *error,
                 struct message *message) {
    static struct remote_written written;
    char storage[COMMAND_LINE_MAX + 1];
    struct command_words words;
    const char *why = NULL;
    if (command_words_split(line, storage, &words, &why) != 0 || words.count == 0) {
        return 0;
    }
    const enum file_command command = command_of(self, &words);
    if (command == NO_FILE_COMMAND) {
        return 0;
    }
    const char *const other = words.count == 3 ? words.word[2] : NULL;
    self->refused = false;
    written = (struct remote_written){.bytes = 0};
    switch (command) {
        case MAKE:
            *error = make(self, line, show, cookie, message);
            break;
        case MEASURE:
            *error = remote_measure(self, &words, show, cookie, message);
            break;
        case SEND:
            *error = send_file(self, words.word[1], other, &written, message);
            break;
        default:
            *error = remote_fetch(self, words.word[1], other, &written, message);
    }
    if (*error != ERROR_OK) {
        *error = show_error(self, show, cookie, *error, message);
    } else if (command == SEND || command == FETCH) {
        remote_show_written(self, show, cookie, &written);
        if (!self->json) {
            show(self, cookie, "OK");
        }
    }
    return 1;
}

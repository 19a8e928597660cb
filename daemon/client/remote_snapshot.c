// SPDX-License-Identifier: Apache-2.0
// The command "snapshot": fetches the image that the instrument made.
#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "core/error.h"
#include "daemon/client/remote.h"

enum { NAME_BYTES = 256, NAMES_MAX = 1000 };

/// The answer to it. Its last line is shown once the image is here.
struct answer {
    remote_show *show;
    void *cookie;
    char file[NAME_BYTES];
};

static void take_line(struct remote *self, void *cookie, const char *text) {
    static const char key[] = "file: ";
    struct answer *answer = cookie;
    struct cJSON *all = self->json ? json_parse(text) : NULL;
    if (strncmp(text, "ERR ", 4) == 0 || (all != NULL && !json_member_true(all, "ok"))) {
        answer->show(self, answer->cookie, text);
    } else if (all != NULL) {
        json_member_text(cJSON_GetObjectItemCaseSensitive(all, "result"), "file", answer->file,
                         sizeof answer->file);
    } else if (strncmp(text, key, sizeof key - 1) == 0) {
        snprintf(answer->file, sizeof answer->file, "%s", text + sizeof key - 1);
    }
    cJSON_Delete(all);
}

/// Whether it is a name as the instrument chooses it: no other file may be fetched or written.
static bool is_of_snapshot(const char *name) {
    static const char begin[] = "snapshot-", end[] = ".png";
    const size_t length = strlen(name);
    return length > sizeof begin + sizeof end - 2 && strncmp(name, begin, sizeof begin - 1) == 0 &&
           strcmp(name + length - (sizeof end - 1), end) == 0 &&
           name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789-.")] == '\0';
}

/// The same name, or with a number appended if it exists: an instrument without a valid clock
/// repeats names.
static void choose_local(const char *name, char local[NAME_BYTES + 8]) {
    const int stem = (int)(strrchr(name, '.') - name);
    struct stat about;
    snprintf(local, NAME_BYTES + 8, "%s", name);
    for (int i = 2; i < NAMES_MAX && lstat(local, &about) == 0; i++) {
        snprintf(local, NAME_BYTES + 8, "%.*s-%d%s", stem, name, i, name + stem);
    }
}

int remote_snapshot(struct remote *self, const char *line, remote_show *show, void *cookie,
                    struct message *message) {
    struct answer answer = {.show = show, .cookie = cookie};
    char local[NAME_BYTES + 8];
    struct remote_written written = {.name = local};
    const int asked = remote_ask(self, line, take_line, &answer, message);
    if (asked != 0) {
        return asked;
    }
    if (!is_of_snapshot(answer.file)) {
        return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
    }
    choose_local(answer.file, local);
    const int error = remote_fetch(self, answer.file, local, &written.bytes, message);
    if (error == 0) {
        remote_show_written(self, show, cookie, &written);
    }
    return error;
}

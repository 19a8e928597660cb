// SPDX-License-Identifier: Apache-2.0
// Answers made by the client, in the form of the daemon's own.
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/json.h"
#include "daemon/client/remote.h"

static void put_result(struct json *json, const struct remote_written *written) {
    json_open_object(json, "result");
    if (written != NULL) {
        json_text(json, written->directory ? "directory" : "file", written->name);
        if (written->directory) {
            json_integer(json, "files", (int64_t)written->files);
        }
        json_integer(json, "size", (int64_t)written->bytes);
    }
    json_close_object(json);
    if (written != NULL) {
        json_open_object(json, "units");
        json_text(json, "size", "bytes");
        json_close_object(json);
    }
}

static void show_json(struct remote *self, remote_show *show, void *cookie,
                      const struct remote_written *written, int error, const char *message) {
    struct json json;
    char *text = NULL;
    size_t bytes = 0;
    FILE *stream = open_memstream(&text, &bytes);
    if (stream == NULL) {
        return;
    }
    json_begin_line(&json, stream);
    json_open_object(&json, NULL);
    put_result(&json, written);
    json_bool(&json, "ok", error == ERROR_OK);
    json_text(&json, "error", error_name(error));
    json_integer(&json, "code", error);
    json_text(&json, "message", message);
    json_close_object(&json);
    json_end(&json);
    if (fclose(stream) == 0) {
        text[strcspn(text, "\n")] = '\0';
        show(self, cookie, text);
    }
    free(text);
}

void remote_show_written(struct remote *self, remote_show *show, void *cookie,
                         const struct remote_written *written) {
    char text[REMOTE_WRITTEN_BYTES + 64];
    char files[32] = "";
    if (self->json) {
        show_json(self, show, cookie, written, 0, "");
        return;
    }
    if (written->directory) {
        snprintf(files, sizeof files, " %" PRIu64 " files,", written->files);
    }
    snprintf(text, sizeof text, "written: %s,%s %" PRIu64 " bytes", written->name, files,
             written->bytes);
    show(self, cookie, text);
}

void remote_show_error(struct remote *self, remote_show *show, void *cookie, int error,
                       const char *message) {
    INVARIANT(self->json && error < 0);
    show_json(self, show, cookie, NULL, error, message);
}

void remote_show_rejection(struct remote *self, remote_show *show, void *cookie, const char *text) {
    char name[32] = "";
    int used = 0;
    int error = ERROR_REFUSED;
    if (!self->json) {
        show(self, cookie, text);
        return;
    }
    if (sscanf(text, "ERR %31s %n", name, &used) < 1 || text[used] == '\0') {
        used = 0;
    }
#define NUMBER_OF(word, number, what)               \
    if (strcmp(name, #word) == 0 && (number) < 0) { \
        error = (number);                           \
    }
    ERROR_LIST(NUMBER_OF)
#undef NUMBER_OF
    remote_show_error(self, show, cookie, error, text + used);
}

// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/reply.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/cli/progress.h"

/// Passes bytes of the stream to the output. Terminals need CR LF.
static ssize_t send_bytes(void *cookie, const char *data, size_t bytes) {
    struct reply *self = cookie;
    self->crc = crc_update(self->crc, data, bytes);
    if (!self->terminal) {
        output_put(self->output, data, bytes);
        return (ssize_t)bytes;
    }
    size_t from = 0;
    for (size_t i = 0; i < bytes; i++) {
        if (data[i] == '\n') {
            output_put(self->output, data + from, i - from);
            output_put_text(self->output, "\r\n");
            from = i + 1;
        }
    }
    output_put(self->output, data + from, bytes - from);
    return (ssize_t)bytes;
}

/// Opens a line of JSON; `event` is NULL in an answer.
static void begin_json(struct reply *self, const char *event) {
    self->crc = 0;
    json_begin_line(&self->json, self->stream);
    json_open_object(&self->json, NULL);
    if (event != NULL) {
        json_text(&self->json, "event", event);
    }
}

static void begin_result(struct reply *self) {
    if (self->begun) {
        return;
    }
    self->begun = true;
    progress_erase(self->stream, self->bar_columns);
    self->bar_columns = 0;
    fflush(self->stream);
    self->crc = 0;
    if (self->request.json) {
        begin_json(self, NULL);
        json_open_object(&self->json, "result");
    }
}

static bool has_unit(const struct reply *self, const char *path) {
    for (size_t at = 0; at < self->units_length;) {
        const char *name = self->units + at;
        if (strcmp(name, path) == 0) {
            return true;
        }
        at += strlen(name) + 1;
        at += strlen(self->units + at) + 1;
    }
    return false;
}

/// Saves the unit under the number's path within its groups, once for all members of a list. `key`
/// is NULL for members of a list of numbers.
static void record_unit(struct reply *self, const char *key, const char *unit) {
    const size_t group = self->path_end[self->depth];
    // A list's path ends in a dot, which only named members need.
    const size_t kept = key != NULL || group == 0 ? group : group - 1;
    char name[2 * REPLY_PATH_BYTES];
    snprintf(name, sizeof name, "%.*s%s", (int)kept, self->path, key != NULL ? key : "");
    const size_t bytes = strlen(name) + 1 + strlen(unit) + 1;
    if (bytes <= sizeof self->units - self->units_length && !has_unit(self, name)) {
        char *to = self->units + self->units_length;
        strcpy(to, name);
        strcpy(to + strlen(name) + 1, unit);
        self->units_length += bytes;
    }
    INVARIANT(self->units_length <= sizeof self->units);
}

/// Writes what precedes an item of text: indentation or comma, and the key. A group's items follow
/// on separate lines, or on the same line inside a list.
static void put_key(struct reply *self, const char *key, bool group) {
    const bool in_line = self->in_line[self->depth];
    if (in_line) {
        fputs(self->first[self->depth] ? "" : ", ", self->stream);
    } else {
        fprintf(self->stream, "%*s", 2 * self->depth, "");
    }
    self->first[self->depth] = false;
    if (key != NULL) {
        fprintf(self->stream, group && !in_line ? "%s:" : in_line ? "%s " : "%s: ", key);
    } else {
        fputs("- ", self->stream);
    }
}

static void put_number(void *cookie, const char *key, double value, int decimals,
                       const char *unit) {
    struct reply *self = cookie;
    begin_result(self);
    if (self->request.json) {
        json_fixed(&self->json, key, value, decimals);
        if (unit != NULL) {
            record_unit(self, key, unit);
        }
        return;
    }
    put_key(self, key, false);
    // As it is typed: "f/8", but "40 mm".
    const bool leads = unit != NULL && unit[strlen(unit) - 1] == '/';
    fprintf(self->stream, "%s%.*f%s%s", leads ? unit : "", decimals, value,
            unit != NULL && !leads ? " " : "", unit != NULL && !leads ? unit : "");
    fputs(self->in_line[self->depth] ? "" : "\n", self->stream);
}

static void put_text(void *cookie, const char *key, const char *value) {
    struct reply *self = cookie;
    begin_result(self);
    if (self->request.json) {
        json_text(&self->json, key, value);
        return;
    }
    put_key(self, key, false);
    for (const char *at = value; *at != '\0'; at++) {
        const bool control = (unsigned char)*at < ' ' || *at == 0x7F;
        fputc(control ? ' ' : *at, self->stream);
    }
    fputs(self->in_line[self->depth] ? "" : "\n", self->stream);
}

/// Adds a group or list to the path that ends at `end`. Returns the number of bytes added.
static size_t extend_path(struct reply *self, size_t end, const char *key, bool array) {
    char step[REPLY_PATH_BYTES];
    const int bytes =
        snprintf(step, sizeof step, "%s%s.", key != NULL ? key : "", array ? "[]" : "");
    // A group in a list has the path of the list.
    if ((key == NULL && !array) || bytes < 0 || end + (size_t)bytes >= sizeof self->path) {
        return 0;
    }
    memcpy(self->path + end, step, (size_t)bytes);
    return (size_t)bytes;
}

static void put_begin(void *cookie, const char *key, bool array) {
    struct reply *self = cookie;
    begin_result(self);
    INVARIANT(self->depth < REPLY_DEPTH_MAX);
    if (self->request.json) {
        (array ? json_open_array : json_open_object)(&self->json, key);
    } else {
        put_key(self, key, true);
    }
    const bool in_list = self->array[self->depth];
    const size_t end = self->path_end[self->depth];
    self->depth++;
    self->array[self->depth] = array;
    self->first[self->depth] = true;
    self->in_line[self->depth] = in_list || self->in_line[self->depth - 1];
    self->path_end[self->depth] = end + extend_path(self, end, key, array);
    if (!self->request.json && !self->in_line[self->depth]) {
        fputc('\n', self->stream);
    }
}

static void put_end(void *cookie) {
    struct reply *self = cookie;
    INVARIANT(self->depth > 0);
    if (self->request.json) {
        (self->array[self->depth] ? json_close_array : json_close_object)(&self->json);
    } else if (self->in_line[self->depth] && !self->in_line[self->depth - 1]) {
        fputc('\n', self->stream);
    }
    self->depth--;
}

static const struct command_reply_operations operations = {
    .number = put_number,
    .text = put_text,
    .begin = put_begin,
    .end = put_end,
};

void reply_open_file(struct reply *self, FILE *file) {
    memset(self, 0, sizeof *self);
    self->items = (struct command_reply){&operations, self};
    self->stream = file;
}

bool reply_open(struct reply *self) {
    const cookie_io_functions_t functions = {.write = send_bytes};
    reply_open_file(self, fopencookie(self, "w", functions));
    return self->stream != NULL && setvbuf(self->stream, NULL, _IOFBF, BUFSIZ) == 0;
}

void reply_close(struct reply *self) {
    if (self->stream != NULL) {
        fclose(self->stream);
        self->stream = NULL;
    }
}

void reply_begin(struct reply *self, struct output *output, const struct request *request,
                 bool terminal) {
    INVARIANT(self->stream != NULL && !(terminal && request->json && request->framed));
    self->output = output;
    self->request = *request;
    self->terminal = terminal;
    self->begun = false;
    self->bar_columns = 0;
    self->depth = 0;
    self->array[0] = false;
    self->in_line[0] = false;
    self->first[0] = true;
    self->path_end[0] = 0;
    self->units_length = 0;
    self->crc = 0;
}

static void frame_line(struct reply *self) {
    if (self->request.framed) {
        fflush(self->stream);
        const uint32_t crc = self->crc;
        fprintf(self->stream, ", \"crc\": \"%08" PRIX32 "\"", crc);
    }
    json_close_object(&self->json);
    json_end(&self->json);
}

void reply_progress(struct reply *self, const char *what, uint32_t done, uint32_t total) {
    if (self->begun || total == 0) {
        return;
    }
    if (self->request.json && self->request.progress) {
        begin_json(self, "progress");
        json_text(&self->json, "what", what);
        json_integer(&self->json, "done", done);
        json_integer(&self->json, "total", total);
        frame_line(self);
    } else if (!self->request.json && !self->terminal && self->request.progress) {
        fprintf(self->stream, "... %s %" PRIu32 "/%" PRIu32 "\n", what, done, total);
    } else if (!self->request.json && self->terminal) {
        self->bar_columns =
            progress_draw(self->stream, SCREEN_COLUMNS, PROGRESS_TEXT_MAX, what, done, total);
    }
    fflush(self->stream);
}

static void put_units(struct reply *self) {
    json_open_object(&self->json, "units");
    for (size_t at = 0; at < self->units_length;) {
        const char *name = self->units + at;
        const char *unit = name + strlen(name) + 1;
        json_text(&self->json, name, unit);
        at += strlen(name) + strlen(unit) + 2;
    }
    json_close_object(&self->json);
}

/// Closes the groups that a failed command left open, and the result.
static void close_groups(struct reply *self) {
    begin_result(self);
    while (self->depth > 0) {
        put_end(self);
    }
    if (self->request.json) {
        json_close_object(&self->json);
        if (self->units_length > 0) {
            put_units(self);
        }
    }
}

static void frame_text(struct reply *self) {
    if (self->request.framed) {
        fputs(" #", self->stream);
        fflush(self->stream);
        const uint32_t crc = self->crc;
        fprintf(self->stream, "%08" PRIX32, crc);
    }
    fputc('\n', self->stream);
}

void reply_end(struct reply *self, int error, const char *message) {
    close_groups(self);
    INVARIANT(self->depth == 0 && error <= 0);
    if (self->request.json) {
        json_bool(&self->json, "ok", error == ERROR_OK);
        json_text(&self->json, "error", error_name(error));
        json_integer(&self->json, "code", error);
        json_text(&self->json, "message", message);
        frame_line(self);
    } else if (error == ERROR_OK) {
        fputs("OK", self->stream);
        frame_text(self);
    } else {
        fprintf(self->stream, "ERR %s %s", error_name(error), message);
        frame_text(self);
    }
    fflush(self->stream);
}

void reply_end_round(struct reply *self) {
    close_groups(self);
    if (self->request.json) {
        json_text(&self->json, "event", "watch");
        frame_line(self);
    } else {
        frame_text(self);
    }
    fflush(self->stream);
}

// SPDX-License-Identifier: Apache-2.0
#include "console/line/reply.h"

#include <string.h>

#include "console/command_text.h"
#include "console/line/progress_bar.h"
#include "core/crc.h"
#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

static void flush(struct reply *self) {
    self->sink.put(self->sink.self, self->part, self->part_bytes);
    self->part_bytes = 0;
}

static void put_byte(struct reply *self, char byte) {
    if (self->part_bytes == sizeof self->part) {
        flush(self);
    }
    self->part[self->part_bytes++] = byte;
}

/// Terminals need CR LF.
static void put(void *cookie, const char *data, size_t bytes) {
    struct reply *self = cookie;
    self->crc = crc_update(self->crc, data, bytes);
    for (size_t i = 0; i < bytes; i++) {
        if (self->terminal && data[i] == '\n') {
            put_byte(self, '\r');
        }
        put_byte(self, data[i]);
    }
}

static void put_string(struct reply *self, const char *text) {
    put(self, text, strlen(text));
}

/// Opens a line of JSON; `event` is NULL in an answer.
static void begin_json(struct reply *self, const char *event) {
    self->crc = 0;
    json_begin_at(&self->json, put, self, true);
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
    if (self->bar_columns > 0) {
        char blank[PROGRESS_BAR_BYTES];
        progress_bar_erase(blank, self->bar_columns);
        put_string(self, blank);
    }
    self->bar_columns = 0;
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
    memcpy(name, self->path, kept);
    struct command_text rest = command_text_begin(name + kept, sizeof name - kept);
    command_text_add(&rest, key != NULL ? key : "");
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
        put_string(self, self->first[self->depth] ? "" : ", ");
    } else {
        for (int i = 0; i < self->depth; i++) {
            put_string(self, "  ");
        }
    }
    self->first[self->depth] = false;
    if (key == NULL) {
        put_string(self, "- ");
        return;
    }
    put_string(self, key);
    const char *separator = group ? ":" : ": ";
    put_string(self, in_line ? " " : separator);
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
    char printed[DECIMAL_TEXT_BYTES];
    decimal_print_double(value, decimals, printed);
    put_string(self, leads ? unit : "");
    put_string(self, printed);
    if (unit != NULL && !leads) {
        put_string(self, " ");
        put_string(self, unit);
    }
    put_string(self, self->in_line[self->depth] ? "" : "\n");
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
        put(self, control ? " " : at, 1);
    }
    put_string(self, self->in_line[self->depth] ? "" : "\n");
}

/// Adds a group or list to the path that ends at `end`. Returns the number of bytes added.
static size_t extend_path(struct reply *self, size_t end, const char *key, bool array) {
    char step[REPLY_PATH_BYTES];
    struct command_text text = command_text_begin(step, sizeof step);
    command_text_join(&text, key != NULL ? key : "", array ? "[]." : ".");
    // A group in a list has the path of the list.
    if ((key == NULL && !array) || end + text.length >= sizeof self->path) {
        return 0;
    }
    memcpy(self->path + end, step, text.length);
    return text.length;
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
        put_string(self, "\n");
    }
}

static void put_end(void *cookie) {
    struct reply *self = cookie;
    INVARIANT(self->depth > 0);
    if (self->request.json) {
        (self->array[self->depth] ? json_close_array : json_close_object)(&self->json);
    } else if (self->in_line[self->depth] && !self->in_line[self->depth - 1]) {
        put_string(self, "\n");
    }
    self->depth--;
}

static const struct command_reply_operations operations = {
    .number = put_number,
    .text = put_text,
    .begin = put_begin,
    .end = put_end,
};

void reply_init(struct reply *self) {
    memset(self, 0, sizeof *self);
    self->items = (struct command_reply){&operations, self};
}

void reply_begin(struct reply *self, const struct reply_sink *sink, const struct request *request,
                 bool terminal) {
    INVARIANT(sink->put != NULL);
    self->sink = *sink;
    self->part_bytes = 0;
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

static void put_crc(struct reply *self, uint32_t crc) {
    static const char digits[] = "0123456789ABCDEF";
    for (int shift = 28; shift >= 0; shift -= 4) {
        put(self, &digits[crc >> shift & 15], 1);
    }
}

static void frame_line(struct reply *self) {
    if (self->request.framed) {
        const uint32_t crc = self->crc;
        put_string(self, ", \"crc\": \"");
        put_crc(self, crc);
        put_string(self, "\"");
    }
    json_close_object(&self->json);
    json_end(&self->json);
}

static void put_progress(struct reply *self, const char *what, uint32_t done, uint32_t total) {
    char number[2][DECIMAL_TEXT_BYTES];
    decimal_print_integer(done, number[0]);
    decimal_print_integer(total, number[1]);
    const char *const words[] = {"... ", what, " ", number[0], "/", number[1], "\n"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        put_string(self, words[i]);
    }
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
        put_progress(self, what, done, total);
    } else if (!self->request.json && self->terminal) {
        char bar[PROGRESS_BAR_BYTES];
        self->bar_columns =
            progress_bar_draw(bar, SCREEN_COLUMNS, PROGRESS_BAR_TEXT_MAX, what, done, total);
        put_string(self, bar);
    }
    flush(self);
}

void reply_bytes(struct reply *self, const void *data, size_t bytes) {
    INVARIANT(self->request.binary && !self->request.framed && !self->terminal);
    INVARIANT(!self->begun && bytes <= REPLY_BYTES_MAX);
    if (self->request.json) {
        begin_json(self, "bytes");
        json_integer(&self->json, "bytes", (int64_t)bytes);
        frame_line(self);
    } else {
        char number[DECIMAL_TEXT_BYTES];
        decimal_print_integer((int64_t)bytes, number);
        put_string(self, "... bytes ");
        put_string(self, number);
        put_string(self, "\n");
    }
    flush(self);
    self->sink.put(self->sink.self, data, bytes);
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
        put_string(self, " #");
        put_crc(self, self->crc);
    }
    put_string(self, "\n");
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
        put_string(self, "OK");
        frame_text(self);
    } else {
        put_string(self, "ERR ");
        put_string(self, error_name(error));
        put_string(self, " ");
        put_string(self, message);
        frame_text(self);
    }
    flush(self);
}

void reply_end_round(struct reply *self) {
    close_groups(self);
    if (self->request.json) {
        json_text(&self->json, "event", "watch");
        frame_line(self);
    } else {
        frame_text(self);
    }
    flush(self);
}

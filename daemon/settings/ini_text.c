// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/ini_text.h"

#include <ini.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

enum { KEY_BYTES = 256 };

struct reading {
    const char *at, *end;
    int line;  ///< line that libinih read last, from 1
    ini_text_set *set;
    void *cookie;
    struct message *message;
    int error, error_line;
};

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r';
}

/// Length of a line without its comment and the blanks at its end.
static size_t content_length(const char *line, size_t length) {
    for (size_t i = 0; i < length; i++) {
        if (line[i] == '#' && (i == 0 || is_blank(line[i - 1]))) {
            length = i;
        }
    }
    while (length > 0 && is_blank(line[length - 1])) {
        length--;
    }
    return length;
}

static void fail(struct reading *self, int error) {
    INVARIANT(error != ERROR_OK && self->error == ERROR_OK);
    self->error = error;
    self->error_line = self->line;
}

/// Gives libinih the next line; NULL ends its reading. To libinih, a line that begins with a blank
/// would continue the one before.
static char *next_line(char *to, int bytes, void *stream) {
    struct reading *self = stream;
    if (self->error != ERROR_OK || self->at == self->end) {
        return NULL;
    }
    const char *line = self->at;
    const char *feed = memchr(line, '\n', (size_t)(self->end - line));
    const char *line_end = feed != NULL ? feed : self->end;
    self->at = feed != NULL ? feed + 1 : self->end;
    self->line++;
    while (line < line_end && is_blank(*line)) {
        line++;
    }
    const size_t length = content_length(line, (size_t)(line_end - line));
    INVARIANT(bytes > 4);
    if (memchr(line, '\0', (size_t)(line_end - line)) != NULL) {
        fail(self, message_set(self->message, ERROR_SYNTAX, "not a text file"));
        return NULL;
    }
    if (length > (size_t)bytes - 4) {
        fail(self, message_set(self->message, ERROR_SYNTAX, "line too long (at most %d characters)",
                               bytes - 4));
        return NULL;
    }
    memcpy(to, line, length);
    to[length] = '\0';
    return to;
}

static int take_pair(void *user, const char *section, const char *name, const char *value) {
    struct reading *self = user;
    char key[KEY_BYTES];
    int error = 0;
    snprintf(key, sizeof key, "%s%s%s", section, *section != '\0' ? "." : "", name);
    if (*name == '\0') {
        error = message_set(self->message, ERROR_MISSING, "\"= %s\": key missing", value);
    } else if (value == NULL || *value == '\0' || *value == '#') {
        // After a blank it would have been removed as a comment.
        error = message_set(self->message, ERROR_MISSING, "%s: value missing", key);
    } else {
        error = self->set(self->cookie, key, value, self->line, self->message);
    }
    if (error != ERROR_OK) {
        fail(self, error);
    }
    return error == ERROR_OK;
}

int ini_text_read(const char *text, size_t length, ini_text_set *set, void *cookie, int *line,
                  struct message *message) {
    struct reading self = {
        .at = text, .end = text + length, .set = set, .cookie = cookie, .message = message};
    const int wrong = ini_parse_stream(next_line, &self, take_pair, &self);
    // libinih reads on after a line that is not a pair, and returns the first.
    if (wrong > 0 && (self.error == ERROR_OK || wrong < self.error_line)) {
        self.error_line = wrong;
        self.error = message_set(message, ERROR_SYNTAX, "invalid line (expected key = value)");
    }
    *line = self.error_line;
    return wrong < 0 ? message_set(message, ERROR_MEMORY, "out of memory") : self.error;
}

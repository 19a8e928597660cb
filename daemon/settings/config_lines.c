// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/config_lines.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/settings/config_keys.h"

enum { FILE_BYTES_MAX = 65536, LINE_BYTES = 512 };

/// Some editors start a UTF-8 file with it, invisibly.
static const char byte_order_mark[] = "\xef\xbb\xbf";

/// Cuts blanks off both ends.
static char *stripped(char *text) {
    text += strspn(text, " \t");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t\r", text[length - 1]) != NULL) {
        text[--length] = '\0';
    }
    return text;
}

/// Cuts the comment off a file's line, and blanks off both ends.
static char *trimmed(char *line) {
    for (char *at = line; *at != '\0'; at++) {
        if (*at == '#' && (at == line || at[-1] == ' ' || at[-1] == '\t')) {
            *at = '\0';
            break;
        }
    }
    return stripped(line);
}

/// A key that sets others comes after one of them.
static int refuse_order(const struct config_lines *self, const char *called, size_t undone,
                        struct message *message) {
    size_t count = 0;
    const char *other = config_key_called(&config_keys(&count)[undone], self->in_profile);
    return self->file != NULL
               ? message_set(message, ERROR_ARGUMENT,
                             "%s must come before %s (line %d), which it would override", called,
                             other, self->places[undone])
               : message_set(message, ERROR_ARGUMENT,
                             "%s must come before %s, which it would override", called, other);
}

/// Whether this key may be set here. 0, or an error.
static int take_place(struct config_lines *self, const struct config_key *key, const char *called,
                      int place, struct message *message) {
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    const size_t i = (size_t)(key - keys);
    INVARIANT(count <= CONFIG_KEYS_MAX && i < count);
    if (self->places[i] != 0) {
        return self->file != NULL
                   ? message_set(message, ERROR_DUPLICATE, "duplicate key %s (first in line %d)",
                                 called, self->places[i])
                   : message_set(message, ERROR_DUPLICATE, "duplicate key %s", called);
    }
    const char *sets = key->sets;
    for (size_t k = 0; sets != NULL && k < count; k++) {
        if (self->places[k] != 0 && strncmp(keys[k].name, sets, strlen(sets)) == 0) {
            return refuse_order(self, called, k, message);
        }
    }
    self->places[i] = place;
    return 0;
}

static int refuse_key(const struct config_lines *self, const char *called, const char *nearest,
                      struct message *message) {
    const char *see =
        self->in_profile ? "see vergenced --help-profile rig" : "see vergenced --help-config";
    return message_set(message, ERROR_ARGUMENT, "unknown key \"%s\" (%s%s%s)", called,
                       nearest != NULL ? "did you mean \"" : see, nearest != NULL ? nearest : "",
                       nearest != NULL ? "\"?" : "");
}

/// Counts a line in the notation of older versions and reports the current notation.
static void add_old_line(const struct config_lines *self, const struct config_key *key,
                         const char *called, const char *value, int place) {
    size_t count = 0;
    char now[CONFIG_TEXT_BYTES + 16];
    if (self->old == NULL) {
        return;
    }
    self->old->count++;
    FILE *report = self->old->report;
    if (report == NULL) {
        return;
    }
    const char *name = config_key_called(key, self->in_profile);
    config_key_print(self->config, (size_t)(key - config_keys(&count)), now, sizeof now);
    if (self->file != NULL) {
        fprintf(report, "%s:%d: ", self->file, place);
    }
    if (strcmp(name, called) == 0) {
        fprintf(report, "%s = %s is an old notation: write %s = %s\n", called, value, name, now);
    } else {
        fprintf(report, "%s is now \"%s\": write %s = %s\n", called, name, name, now);
    }
}

static int set_key(struct config_lines *self, const char *called, const char *value, int place,
                   struct message *message) {
    bool old = false;
    const char *nearest = NULL;
    const struct config_key *key = config_key_find(called, self->in_profile, &old, &nearest);
    if (key == NULL) {
        return refuse_key(self, called, nearest, message);
    }
    int error = take_place(self, key, called, place, message);
    if (error != 0) {
        return error;
    }
    const struct config_lines_profiles *profiles =
        key->kind == CONFIG_PROFILE ? self->profiles : NULL;
    if (profiles != NULL && profiles->is_file(value)) {
        return profiles->load(self->config, self->file, value, self->old, message);
    }
    old = config_key_is_old(key, old, value);
    error = config_key_set(self->config, key, called, value, old, message);
    if (error == 0 && old) {
        add_old_line(self, key, called, value, place);
    }
    return error;
}

/// One line or argument, without blanks at its ends.
static int set_one(struct config_lines *self, char *setting, int place, struct message *message) {
    char *equals = strchr(setting, '=');
    if (equals == NULL) {
        return message_set(message, self->file != NULL ? ERROR_SYNTAX : ERROR_ARGUMENT,
                           "invalid setting \"%s\" (expected %s)", setting,
                           self->file != NULL ? "key = value" : "KEY=VALUE");
    }
    if (equals == setting) {
        return message_set(message, ERROR_MISSING, "\"%s\": key missing", setting);
    }
    *equals = '\0';
    const char *name = stripped(setting);
    const char *value = stripped(equals + 1);
    // After a blank it would have been removed as a comment.
    const bool is_comment = self->file != NULL && *value == '#';
    if (*value == '\0' || is_comment) {
        return message_set(message, ERROR_MISSING, "%s: value missing", name);
    }
    return set_key(self, name, value, place, message);
}

int config_lines_at(const char *file, int line, int error, struct message *message) {
    struct message inner = *message;
    return message_set(message, error, "%s:%d: %.900s", file, line, inner.text);
}

int config_lines_set(struct config_lines *self, const char *text, size_t length,
                     struct message *message) {
    const size_t mark = sizeof byte_order_mark - 1;
    const bool marked = length >= mark && memcmp(text, byte_order_mark, mark) == 0;
    int number = 0;
    for (size_t at = marked ? mark : 0; at < length;) {
        const char *end = memchr(text + at, '\n', length - at);
        const size_t bytes = end != NULL ? (size_t)(end - text) - at : length - at;
        char line[LINE_BYTES];
        number++;
        if (bytes >= sizeof line || memchr(text + at, '\0', bytes) != NULL) {
            message_set(message, 0, "line too long, or not a text file");
            return config_lines_at(self->file, number, ERROR_SYNTAX, message);
        }
        memcpy(line, text + at, bytes);
        line[bytes] = '\0';
        at += bytes + 1;
        char *content = trimmed(line);
        const int error = *content != '\0' ? set_one(self, content, number, message) : 0;
        if (error != 0) {
            return config_lines_at(self->file, number, error, message);
        }
    }
    return 0;
}

int config_lines_arguments(struct config_lines *self, const char *const *words, int count,
                           struct message *message) {
    for (int i = 0; i < count; i++) {
        char word[LINE_BYTES];
        if (strlen(words[i]) >= sizeof word) {
            return message_set(message, ERROR_RANGE,
                               "\"%.40s...\": too long (at most %d characters)", words[i],
                               LINE_BYTES - 1);
        }
        memcpy(word, words[i], strlen(words[i]) + 1);
        const int error = set_one(self, stripped(word), i + 1, message);
        if (error != 0) {
            return error;
        }
    }
    return 0;
}

int config_lines_read(struct config_lines *self, FILE *file, struct message *message) {
    char *text = malloc(FILE_BYTES_MAX);
    if (text == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", self->file);
    }
    errno = 0;
    const size_t length = fread(text, 1, FILE_BYTES_MAX, file);
    const int number = errno;
    int error = 0;
    if (ferror(file) != 0) {
        error = message_set(message, ERROR_IO, "%s: %s", self->file, strerror(number));
    } else if (length == FILE_BYTES_MAX) {
        error = message_set(message, ERROR_SYNTAX,
                            "%s: too large for a settings file (at most %d bytes)", self->file,
                            FILE_BYTES_MAX - 1);
    } else {
        error = config_lines_set(self, text, length, message);
    }
    free(text);
    return error;
}

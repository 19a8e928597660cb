// SPDX-License-Identifier: Apache-2.0
// Settings from the lines of files and the arguments of a command line: all are collected, then set
// in the order of the table.
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/input_file.h"
#include "daemon/settings/config.h"
#include "daemon/settings/config_keys.h"
#include "daemon/settings/ini_text.h"

enum { FILE_BYTES_MAX = 65536 };

/// A reading of settings or of a profile.
struct loading {
    struct config *config;
    struct config_line *lines;  ///< one entry for each key; an argument replaces the line of a file
    const char *file;           ///< its name in messages; NULL: a command line
    bool in_profile, opens_files;
    struct config_old_lines *old;  ///< NULL: not counted
    struct message *message;
};

int config_line_error(const struct config_line *line, int error, struct message *message) {
    const struct message inner = *message;
    INVARIANT(error != ERROR_OK);
    return line->file == NULL
               ? error
               : message_set(message, error, "%s:%d: %.900s", line->file, line->number, inner.text);
}

static int reject_key(const struct loading *self, const struct suggest *suggest) {
    const char *see =
        self->in_profile ? " (see vergenced --help-profile rig)" : " (see vergenced --help-config)";
    return message_set(self->message, ERROR_ARGUMENT, "unknown key \"%s\"%s", suggest->typed,
                       suggest->text[0] != '\0' ? suggest->text : see);
}

/// Takes a line or an argument.
static int take_option(void *cookie, const char *called, const char *value, int number,
                       struct message *message) {
    struct loading *self = cookie;
    size_t count = 0;
    bool old_name = false;
    struct suggest suggest;
    const struct config_key *key = config_key_find(called, self->in_profile, &old_name, &suggest);
    if (key == NULL) {
        return reject_key(self, &suggest);
    }
    struct config_line *line = &self->lines[key - config_keys(&count)];
    INVARIANT(count <= CONFIG_KEYS_MAX && strlen(called) < sizeof line->called);
    INVARIANT(strlen(value) < sizeof line->value);
    if (line->number != 0 && line->file == self->file) {
        return self->file != NULL
                   ? message_set(message, ERROR_DUPLICATE, "duplicate key %s (first in line %d)",
                                 called, line->number)
                   : message_set(message, ERROR_DUPLICATE, "duplicate key %s", called);
    }
    line->file = self->file;
    line->number = number;
    line->old = config_key_is_old(key, old_name, value);
    strcpy(line->called, called);
    strcpy(line->value, value);
    return 0;
}

static int take_text(struct loading *self, const char *text, size_t length) {
    struct config_line line = {.file = self->file};
    const int error = ini_text_read(text, length, take_option, self, &line.number, self->message);
    return error != ERROR_OK ? config_line_error(&line, error, self->message) : ERROR_OK;
}

static int take_file(struct loading *self, FILE *file) {
    char *text = malloc(FILE_BYTES_MAX);
    if (text == NULL) {
        return message_set(self->message, ERROR_MEMORY, "out of memory");
    }
    errno = 0;
    const size_t length = fread(text, 1, FILE_BYTES_MAX, file);
    int error = ERROR_OK;
    if (ferror(file) != 0) {
        error = message_set(self->message, ERROR_IO, "%s: %s", self->file, strerror(errno));
    } else if (length == FILE_BYTES_MAX) {
        error = message_set(self->message, ERROR_SYNTAX,
                            "%s: too large for a settings file (at most %d bytes)", self->file,
                            FILE_BYTES_MAX - 1);
    } else {
        error = take_text(self, text, length);
    }
    free(text);
    return error;
}

/// Cuts blanks off both ends.
static char *stripped(char *text) {
    text += strspn(text, " \t");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t", text[length - 1]) != NULL) {
        text[--length] = '\0';
    }
    return text;
}

/// Takes an argument KEY=VALUE.
static int take_word(struct loading *self, const char *word, int number) {
    char text[CONFIG_LINE_BYTES];
    struct message *message = self->message;
    if (strlen(word) >= sizeof text) {
        return message_set(message, ERROR_RANGE, "\"%.40s...\": too long (at most %zu characters)",
                           word, sizeof text - 1);
    }
    strcpy(text, word);
    char *equals = strchr(text, '=');
    if (equals == NULL) {
        return message_set(message, ERROR_ARGUMENT, "invalid setting \"%s\" (expected KEY=VALUE)",
                           word);
    }
    *equals = '\0';
    const char *key = stripped(text), *value = stripped(equals + 1);
    if (*key == '\0' || *value == '\0') {
        return message_set(message, ERROR_MISSING,
                           *key == '\0' ? "\"%s\": key missing" : "%s: value missing",
                           *key == '\0' ? word : key);
    }
    return take_option(self, key, value, number, message);
}

/// Counts a line in the notation of older versions and reports the current notation.
static void report_old(const struct loading *self, size_t key, const struct config_line *line) {
    char value[CONFIG_VALUE_BYTES];
    size_t count = 0;
    if (self->old == NULL) {
        return;
    }
    self->old->count++;
    FILE *report = self->old->report;
    if (report != NULL) {
        config_key_print(self->config, key, value, sizeof value);
        if (line->file != NULL) {
            fprintf(report, "%s:%d: ", line->file, line->number);
        }
        fprintf(report, "%s = %s is an old notation: write %s = %s\n", line->called, line->value,
                config_key_called(&config_keys(&count)[key], self->in_profile), value);
    }
}

static bool is_profile_file(const char *name) {
    static const char ending[] = ".profile";
    const size_t length = strlen(name), bytes = sizeof ending - 1;
    return length > bytes && strcmp(name + length - bytes, ending) == 0;
}

static int load_profile(const struct loading *outer, const char *relative_to, const char *name);

/// Sets what was taken.
static int set_all(const struct loading *self) {
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    for (size_t i = 0; i < count; i++) {
        const struct config_line *line = &self->lines[i];
        if (line->number == 0) {
            continue;
        }
        const bool file = keys[i].kind == CONFIG_PROFILE && self->opens_files &&
                          !self->in_profile &&
                          (strchr(line->value, '/') != NULL || is_profile_file(line->value));
        const int error = file ? load_profile(self, line->file, line->value)
                               : config_key_set(self->config, &keys[i], line->called, line->value,
                                                line->old, self->message);
        if (error != ERROR_OK) {
            return config_line_error(line, error, self->message);
        }
        if (line->old) {
            report_old(self, i, line);
        }
    }
    return 0;
}

/// Begins a reading; false with a message: out of memory.
static bool begin(struct loading *self) {
    self->lines = calloc(CONFIG_KEYS_MAX, sizeof *self->lines);
    if (self->lines == NULL) {
        message_set(self->message, ERROR_MEMORY, "out of memory");
    }
    return self->lines != NULL;
}

/// Sets and checks what was taken, unless there is an error, and ends the reading.
static int end(struct loading *self, int error) {
    struct config *config = self->config;
    if (error == ERROR_OK && self->in_profile && self->lines[0].number == 0) {
        error = message_set(self->message, ERROR_MISSING,
                            "%s: " CONFIG_LIKE " missing (start with " CONFIG_LIKE
                            " = rig, two-cameras or two-cameras-lens)",
                            self->file);
    }
    error = error != ERROR_OK ? error : set_all(self);
    if (error == ERROR_OK) {
        error = config_check_lines(config, self->lines, self->in_profile, self->message);
    }
    if (error == ERROR_OK && self->in_profile) {
        INVARIANT(strlen(self->file) < sizeof config->profile_file);
        strcpy(config->profile_file, self->file);
    }
    free(self->lines);
    return error;
}

/// Reads the profile `name`, which is relative to the directory of the file `relative_to` (NULL: to
/// the working directory).
static int load_profile(const struct loading *outer, const char *relative_to, const char *name) {
    char path[CONFIG_TEXT_BYTES];
    struct loading self = *outer;
    const char *slash = relative_to != NULL && name[0] != '/' ? strrchr(relative_to, '/') : NULL;
    const int folder = slash != NULL ? (int)(slash - relative_to) + 1 : 0;
    INVARIANT(!outer->in_profile);
    if (snprintf(path, sizeof path, "%.*s%s", folder, folder > 0 ? relative_to : "", name) >=
        (int)sizeof path) {
        return message_set(self.message, ERROR_RANGE,
                           "profile %s: path too long (at most %zu characters with its directory)",
                           name, sizeof path - 1);
    }
    FILE *file = input_file_open(path, self.message);
    if (file == NULL) {
        return ERROR_IO;
    }
    self.file = path;
    self.in_profile = true;
    const int error = begin(&self) ? end(&self, take_file(&self, file)) : ERROR_MEMORY;
    fclose(file);
    return error;
}

int config_parse(struct config *config, const char *name, const char *text, size_t length,
                 struct message *message) {
    struct loading self = {
        .config = config, .file = name, .in_profile = is_profile_file(name), .message = message};
    config_defaults(config);
    return begin(&self) ? end(&self, take_text(&self, text, length)) : ERROR_MEMORY;
}

static int take_settings(struct loading *self, const char *path) {
    FILE *file = fopen(path, "re");
    if (file == NULL) {
        return message_set(self->message, ERROR_IO, "%s: %s", path, strerror(errno));
    }
    self->file = path;
    const int error = take_file(self, file);
    self->file = NULL;
    fclose(file);
    return error;
}

int config_load(struct config *config, const char *path, const char *const *words, int count,
                struct config_old_lines *old, struct message *message) {
    struct loading self = {.config = config, .opens_files = true, .old = old, .message = message};
    int error = 0;
    config_defaults(config);
    if (!begin(&self)) {
        return ERROR_MEMORY;
    }
    if (path != NULL && is_profile_file(path)) {
        error = strlen(path) < CONFIG_TEXT_BYTES
                    ? take_option(&self, CONFIG_PROFILE_KEY, path, 1, message)
                    : message_set(message, ERROR_RANGE, "%s: path too long", path);
    } else if (path != NULL) {
        error = take_settings(&self, path);
    }
    for (int i = 0; i < count && error == ERROR_OK; i++) {
        error = take_word(&self, words[i], i + 1);
    }
    return end(&self, error);
}

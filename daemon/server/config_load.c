// SPDX-License-Identifier: Apache-2.0
// Where settings come from: a file's lines, and the words of a command line over them.
#include <errno.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/server/config.h"
#include "daemon/server/config_check.h"
#include "daemon/server/config_keys.h"

enum { FILE_BYTES_MAX = 65536, LINE_BYTES = 512 };

/// What some editors put in front of UTF-8, where nobody sees it.
static const char byte_order_mark[] = "\xef\xbb\xbf";

/// Lines of a file or words of a command line, which follow the same rules.
struct source {
    struct config *config;
    const char *file;             ///< its name in messages; NULL: a command line
    int places[CONFIG_KEYS_MAX];  ///< for each key the line or word that set it, from 1; 0: none
};

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

/// "above rig.width_px (line 3)"; on a command line everybody sees where it stands.
static int refuse_order(const struct source *self, const char *name, size_t undone,
                        struct message *message) {
    const char *other = config_key_name(undone);
    return self->file != NULL
               ? message_set(message, ERROR_ARGUMENT,
                             "%s must stand above %s (line %d), which it would undo", name, other,
                             self->places[undone])
               : message_set(message, ERROR_ARGUMENT,
                             "%s must stand before %s, which it would undo", name, other);
}

/// Whether this key may be set here. 0, or an error.
static int take_place(struct source *self, const char *name, int place, struct message *message) {
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    INVARIANT(count <= CONFIG_KEYS_MAX);
    size_t i = 0;
    while (i < count && strcmp(keys[i].name, name) != 0) {
        i++;
    }
    if (i == count) {
        return 0;  // config_set says so, and which one may be meant
    }
    if (self->places[i] != 0) {
        return self->file != NULL
                   ? message_set(message, ERROR_DUPLICATE, "%s was set in line %d already", name,
                                 self->places[i])
                   : message_set(message, ERROR_DUPLICATE, "%s is given twice", name);
    }
    const char *sets = keys[i].sets;
    for (size_t k = 0; sets != NULL && k < count; k++) {
        if (self->places[k] != 0 && strncmp(keys[k].name, sets, strlen(sets)) == 0) {
            return refuse_order(self, name, k, message);
        }
    }
    self->places[i] = place;
    return 0;
}

/// One line or word without blanks at its ends.
static int set_one(struct source *self, char *setting, int place, struct message *message) {
    char *equals = strchr(setting, '=');
    if (equals == NULL) {
        return message_set(message, self->file != NULL ? ERROR_SYNTAX : ERROR_ARGUMENT,
                           "\"%s\": expected is %s", setting,
                           self->file != NULL ? "key = value" : "KEY=VALUE");
    }
    if (equals == setting) {
        return message_set(message, ERROR_MISSING, "\"%s\": the name of the key is missing",
                           setting);
    }
    *equals = '\0';
    const char *name = stripped(setting);
    const char *value = stripped(equals + 1);
    // Behind a blank it would have been cut off as a comment.
    const bool is_comment = self->file != NULL && *value == '#';
    if (*value == '\0' || is_comment) {
        return message_set(message, ERROR_MISSING, "%s: the value is missing", name);
    }
    const int error = take_place(self, name, place, message);
    return error != 0 ? error : config_set(self->config, name, value, message);
}

static int at_line(const char *name, int line, int error, struct message *message) {
    struct message inner = *message;
    return message_set(message, error, "%s:%d: %.900s", name, line, inner.text);
}

static int set_lines(struct source *self, const char *text, size_t length,
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
            message_set(message, 0, "the line is too long, or this is no text file");
            return at_line(self->file, number, ERROR_SYNTAX, message);
        }
        memcpy(line, text + at, bytes);
        line[bytes] = '\0';
        at += bytes + 1;
        char *content = trimmed(line);
        const int error = *content != '\0' ? set_one(self, content, number, message) : 0;
        if (error != 0) {
            return at_line(self->file, number, error, message);
        }
    }
    return 0;
}

static int set_words(struct source *self, const char *const *words, int count,
                     struct message *message) {
    for (int i = 0; i < count; i++) {
        char word[LINE_BYTES];
        if (strlen(words[i]) >= sizeof word) {
            return message_set(message, ERROR_RANGE, "\"%.40s...\" is longer than %d characters",
                               words[i], LINE_BYTES - 1);
        }
        memcpy(word, words[i], strlen(words[i]) + 1);
        const int error = set_one(self, stripped(word), i + 1, message);
        if (error != 0) {
            return error;
        }
    }
    return 0;
}

/// Everything once more, in the order of the table, where a key that sets others stands before
/// them: so a word with such a key undoes no line.
static void join(struct config *config, const struct source *lines, const struct source *words) {
    config_defaults(config);
    for (size_t i = 0; i < config_key_count(); i++) {
        char value[CONFIG_TEXT_BYTES + 16];
        struct message message;
        if (words->places[i] == 0 && lines->places[i] == 0) {
            continue;
        }
        const struct source *source = words->places[i] != 0 ? words : lines;
        config_key_print(source->config, i, value, sizeof value);
        const int error = config_set(config, config_key_name(i), value, &message);
        INVARIANT(error == 0);
    }
}

/// Whether all goes together; what a word has set stands in no line.
static int check_together(const struct config *config, const struct source *lines,
                          const struct source *words, struct message *message) {
    enum { BY_A_WORD = -1 };
    int places[CONFIG_KEYS_MAX];
    bool has_words = false;
    for (size_t i = 0; i < CONFIG_KEYS_MAX; i++) {
        const bool by_a_word = words != NULL && words->places[i] != 0;
        places[i] = by_a_word ? BY_A_WORD : lines->places[i];
        has_words = has_words || by_a_word;
    }
    int line = 0;
    const int error = config_check_lines(config, places, &line, message);
    if (error == 0 || line == BY_A_WORD) {
        return error;
    }
    if (line != 0) {
        return at_line(lines->file, line, error, message);
    }
    if (lines->file == NULL || has_words) {
        return error;
    }
    const struct message inner = *message;
    return message_set(message, error, "%s: %.900s", lines->file, inner.text);
}

int config_parse(struct config *config, const char *name, const char *text, size_t length,
                 struct message *message) {
    struct source lines = {.config = config, .file = name};
    const int error = set_lines(&lines, text, length, message);
    return error != 0 ? error : check_together(config, &lines, NULL, message);
}

static int read_lines(struct source *self, struct message *message) {
    static char text[FILE_BYTES_MAX];
    FILE *file = fopen(self->file, "re");
    if (file == NULL) {
        return message_set(message, ERROR_IO, "%s: %s", self->file, strerror(errno));
    }
    errno = 0;
    const size_t length = fread(text, 1, sizeof text, file);
    const int number = errno;
    const bool failed = ferror(file) != 0;
    fclose(file);
    if (failed) {
        return message_set(message, ERROR_IO, "%s: %s", self->file, strerror(number));
    }
    if (length == sizeof text) {
        return message_set(message, ERROR_SYNTAX, "%s: is no file of settings: longer than %d",
                           self->file, FILE_BYTES_MAX);
    }
    return set_lines(self, text, length, message);
}

int config_load(struct config *config, const char *path, const char *const *words, int count,
                struct message *message) {
    struct config by_lines, by_words;
    struct source lines = {.config = &by_lines, .file = path};
    struct source given = {.config = &by_words};
    config_defaults(&by_lines);
    config_defaults(&by_words);
    int error = path != NULL ? read_lines(&lines, message) : 0;
    error = error != 0 ? error : set_words(&given, words, count, message);
    if (error != 0) {
        return error;
    }
    join(config, &lines, &given);
    return check_together(config, &lines, &given, message);
}

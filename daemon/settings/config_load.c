// SPDX-License-Identifier: Apache-2.0
// Where settings come from: a file's lines, and the words of a command line over them.
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/settings/config.h"
#include "daemon/settings/config_check.h"
#include "daemon/settings/config_keys.h"
#include "daemon/settings/config_lines.h"
#include "daemon/settings/config_profile.h"

/// Everything once more, in the order of the table, where a key that sets others stands before
/// them: so a word with such a key undoes no line.
static void join(struct config *config, const struct config_lines *lines,
                 const struct config_lines *words) {
    config_defaults(config);
    for (size_t i = 0; i < config_key_count(); i++) {
        char value[CONFIG_TEXT_BYTES + 16];
        struct message message;
        size_t count = 0;
        if (words->places[i] == 0 && lines->places[i] == 0) {
            continue;
        }
        const struct config_lines *source = words->places[i] != 0 ? words : lines;
        if (config_keys(&count)[i].kind == CONFIG_PROFILE) {
            config_take_profile(config, source->config);  // its file may have changed meanwhile
            continue;
        }
        config_key_print(source->config, i, value, sizeof value);
        const int error = config_set(config, config_key_name(i), value, &message);
        INVARIANT(error == 0);
    }
}

/// Whether all goes together; what a word has set stands in no line.
static int check_together(const struct config *config, const struct config_lines *lines,
                          const struct config_lines *words, struct message *message) {
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
        return config_lines_at(lines->file, line, error, message);
    }
    if (lines->file == NULL || has_words) {
        return error;
    }
    const struct message inner = *message;
    return message_set(message, error, "%s: %.900s", lines->file, inner.text);
}

int config_parse(struct config *config, const char *name, const char *text, size_t length,
                 struct message *message) {
    struct config_lines lines = {.config = config, .file = name};
    const int error = config_lines_set(&lines, text, length, message);
    return error != 0 ? error : check_together(config, &lines, NULL, message);
}

static int read_lines(struct config_lines *self, struct message *message) {
    FILE *file = fopen(self->file, "re");
    if (file == NULL) {
        return message_set(message, ERROR_IO, "%s: %s", self->file, strerror(errno));
    }
    const int error = config_lines_read(self, file, message);
    fclose(file);
    return error;
}

int config_load(struct config *config, const char *path, const char *const *words, int count,
                struct message *message) {
    static const struct config_lines_profiles profiles = {config_profile_is_file,
                                                          config_profile_load};
    struct config by_lines, by_words;
    struct config_lines lines = {.config = &by_lines, .file = path, .profiles = &profiles};
    struct config_lines given = {.config = &by_words, .profiles = &profiles};
    config_defaults(&by_lines);
    config_defaults(&by_words);
    int error = path != NULL ? read_lines(&lines, message) : 0;
    error = error != 0 ? error : config_lines_words(&given, words, count, message);
    if (error != 0) {
        return error;
    }
    join(config, &lines, &given);
    return check_together(config, &lines, &given, message);
}

// SPDX-License-Identifier: Apache-2.0
// Settings from the lines of a file and the arguments of a command line, which override them.
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

/// Sets everything again, in the order of the table, where a key that sets others comes before
/// them: so an argument with such a key overrides no line.
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

/// Whether all settings are consistent. What an argument has set is in no line.
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

/// As config_load, with one more argument unless it is NULL.
static int load(struct config *config, const char *path, const char *const *words, int count,
                const char *last_word, struct config_old_lines *old, struct message *message) {
    static const struct config_lines_profiles profiles = {config_profile_is_file,
                                                          config_profile_load};
    struct config by_lines, by_words;
    struct config_lines lines = {
        .config = &by_lines, .file = path, .profiles = &profiles, .old = old};
    struct config_lines given = {.config = &by_words, .profiles = &profiles, .old = old};
    config_defaults(&by_lines);
    config_defaults(&by_words);
    int error = path != NULL ? read_lines(&lines, message) : 0;
    error = error != 0 ? error : config_lines_arguments(&given, words, count, message);
    if (error == 0 && last_word != NULL) {
        error = config_lines_arguments(&given, &last_word, 1, message);
    }
    if (error != 0) {
        return error;
    }
    join(config, &lines, &given);
    return check_together(config, &lines, &given, message);
}

int config_load(struct config *config, const char *path, const char *const *words, int count,
                struct config_old_lines *old, struct message *message) {
    return load(config, path, words, count, NULL, old, message);
}

int config_load_to_check(struct config *config, const char *path, const char *const *words,
                         int count, struct config_old_lines *old, struct message *message) {
    static const char key[] = CONFIG_PROFILE_KEY "=";
    char profile[sizeof key + CONFIG_TEXT_BYTES];
    if (!config_profile_has_ending(path)) {
        return config_load(config, path, words, count, old, message);
    }
    if ((size_t)snprintf(profile, sizeof profile, "%s%s", key, path) >= sizeof profile) {
        return message_set(message, ERROR_RANGE, "%s: path too long", path);
    }
    return load(config, NULL, words, count, profile, old, message);
}

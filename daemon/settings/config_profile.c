// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/config_profile.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/input_file.h"
#include "daemon/settings/config_check.h"
#include "daemon/settings/config_keys.h"
#include "daemon/settings/config_lines.h"

bool config_profile_has_ending(const char *name) {
    static const char ending[] = ".profile";
    const size_t length = strlen(name), bytes = sizeof ending - 1;
    return length > bytes && strcmp(name + length - bytes, ending) == 0;
}

bool config_profile_is_file(const char *value) {
    return strchr(value, '/') != NULL || config_profile_has_ending(value);
}

/// Index of the key `profile`, which a profile calls `like`.
static size_t place_of_like(void) {
    size_t count = 0, i = 0;
    const struct config_key *keys = config_keys(&count);
    while (i < count && keys[i].kind != CONFIG_PROFILE) {
        i++;
    }
    INVARIANT(i < count);
    return i;
}

/// Checks what was read as a whole.
static int finish(struct config_lines *self, struct message *message) {
    int line = 0;
    if (self->places[place_of_like()] == 0) {
        return message_set(message, ERROR_MISSING,
                           "%s: " CONFIG_LIKE " missing (start with " CONFIG_LIKE
                           " = rig, two-cameras or two-cameras-lens)",
                           self->file);
    }
    const int error = config_check_profile(self->config, self->places, &line, message);
    if (error != 0) {
        return config_lines_at(self->file, line, error, message);
    }
    INVARIANT(strlen(self->file) < sizeof self->config->profile_file);
    strcpy(self->config->profile_file, self->file);
    self->config->base = self->config->profile;
    return 0;
}

int config_profile_parse(struct config *config, const char *name, const char *text, size_t length,
                         struct message *message) {
    struct config_lines lines = {.config = config, .file = name, .in_profile = true};
    const int error = config_lines_set(&lines, text, length, message);
    return error != 0 ? error : finish(&lines, message);
}

int config_profile_load(struct config *config, const char *relative_to, const char *name,
                        struct config_old_lines *old, struct message *message) {
    const char *slash = relative_to != NULL && name[0] != '/' ? strrchr(relative_to, '/') : NULL;
    const size_t folder = slash != NULL ? (size_t)(slash - relative_to) + 1 : 0;
    char path[CONFIG_TEXT_BYTES];
    if (folder + strlen(name) >= sizeof path) {
        return message_set(message, ERROR_RANGE,
                           "profile %s: path too long (at most %zu characters with its directory)",
                           name, sizeof path - 1);
    }
    memcpy(path, relative_to != NULL ? relative_to : "", folder);
    strcpy(path + folder, name);
    FILE *file = input_file_open(path, message);
    if (file == NULL) {
        const struct message why = *message;
        return message_set(message, ERROR_IO, "%.900s", why.text);
    }
    struct config_lines lines = {.config = config, .file = path, .in_profile = true, .old = old};
    const int error = config_lines_read(&lines, file, message);
    fclose(file);
    return error != 0 ? error : finish(&lines, message);
}

int config_profile_print(FILE *file, const char *name, struct message *message) {
    struct config config;
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    config_defaults(&config);
    const int error =
        config_key_set(&config, &keys[place_of_like()], "--help-profile", name, false, message);
    if (error != 0) {
        return error;
    }
    fputs("# SPDX-License-Identifier: Apache-2.0\n", file);
    config_comment_print(file,
                         "A profile of vergenced: the cameras, FPGA, servos and lenses of an "
                         "instrument. For an instrument of your own, copy this file, change what "
                         "differs, delete the other lines, give it another name, and set profile = "
                         "FILE in the settings. Check it with: vergenced --check FILE");
    fputc('\n', file);
    config_comment_print(file,
                         "the built-in profile that it starts from (rig two-cameras "
                         "two-cameras-lens)");
    fprintf(file, CONFIG_LIKE " = %s\n", name);
    for (size_t i = 0; i < count; i++) {
        if (config_key_is_of_rig(i)) {
            config_key_explain(file, &config, &keys[i], true, "");
        }
    }
    return 0;
}

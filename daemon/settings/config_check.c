// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/config_check.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/serial_device.h"
#include "daemon/settings/config_keys.h"
#include "daemon/settings/fault_plan.h"

enum { VALUE_BYTES = CONFIG_TEXT_BYTES + 16, RANGE_BYTES = 192, SETTING_BYTES = VALUE_BYTES + 64 };

/// What a check needs.
struct check {
    const struct config *config;
    const int *lines;
    int *line;
    struct message *message;
    bool in_profile;  ///< keys have the names of a profile
};

/// Index of an existing key, prefix and name.
static size_t key_of(const char *prefix, const char *name) {
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    const size_t bytes = strlen(prefix);
    size_t i = 0;
    while (i < count &&
           (strncmp(keys[i].name, prefix, bytes) != 0 || strcmp(keys[i].name + bytes, name) != 0)) {
        i++;
    }
    INVARIANT(i < count);
    return i;
}

/// "rig.width = 4000 px".
static void print_setting(const struct check *self, size_t key, char text[SETTING_BYTES]) {
    char value[VALUE_BYTES];
    size_t count = 0;
    config_key_print(self->config, key, value, sizeof value);
    snprintf(text, SETTING_BYTES, "%s = %s",
             config_key_called(&config_keys(&count)[key], self->in_profile), value);
}

/// Takes the line of this key, with which the message starts.
static void show_key(const struct check *self, size_t key) {
    if (self->lines[key] != 0) {
        *self->line = self->lines[key];
    }
}

// ---- the profile

/// "an even number, 16 to 2048 px", "no".
static void print_range(const struct rig_profile_error *profile_error, char text[RANGE_BYTES]) {
    size_t count = 0;
    const struct config_key *key = &config_keys(&count)[key_of(CONFIG_RIG, profile_error->field)];
    char word[COMMAND_CHOICE_MAX];
    char range[QUANTITY_RANGE_BYTES];
    if (key->choices != NULL) {
        const bool found = command_words_choice_at(key->choices, profile_error->min, word);
        INVARIANT(found);
        snprintf(text, RANGE_BYTES, "%s", word);
    } else if (profile_error->min == profile_error->max) {
        quantity_print(key->quantity, profile_error->min, range);
        snprintf(text, RANGE_BYTES, "%s", range);
    } else {
        quantity_print_range(key->quantity, profile_error->min, profile_error->max, range);
        snprintf(text, RANGE_BYTES, "%s%s",
                 profile_error->other  ? "a different one, "
                 : profile_error->even ? "an even number, "
                                       : "",
                 range);
    }
}

/// Starts with the field or, where no line has set it, with a cause that a line has set.
static int report_profile_error(const struct check *self,
                                const struct rig_profile_error *profile_error) {
    const size_t field = key_of(CONFIG_RIG, profile_error->field);
    size_t count = 0;
    char range[RANGE_BYTES];
    char setting[SETTING_BYTES];
    char causes[RIG_PROFILE_CAUSES * SETTING_BYTES] = "";
    print_range(profile_error, range);
    for (size_t i = 0; i < RIG_PROFILE_CAUSES && profile_error->causes[i] != NULL; i++) {
        const size_t cause = key_of(CONFIG_RIG, profile_error->causes[i]);
        char other[SETTING_BYTES];
        print_setting(self, cause, other);
        if (self->lines[field] == 0 && self->lines[cause] != 0) {
            show_key(self, cause);
            print_setting(self, field, setting);
            return message_set(self->message, ERROR_RANGE,
                               "%s conflicts with %s (expected %s for %s)", other, setting, range,
                               config_key_called(&config_keys(&count)[field], self->in_profile));
        }
        const size_t used = strlen(causes);
        snprintf(causes + used, sizeof causes - used, "%s%s", i == 0 ? "" : " and ", other);
    }
    show_key(self, field);
    print_setting(self, field, setting);
    return causes[0] != '\0'
               ? message_set(self->message, ERROR_RANGE, "%s conflicts with %s (expected %s)",
                             setting, causes, range)
               : message_set(self->message, ERROR_RANGE, "%s: out of range (expected %s)", setting,
                             range);
}

// ---- devices of the instrument

/// A device or a GPIO line.
struct place {
    bool needed;
    const char *key;
    enum { BY_LINE, BY_PROFILE, BY_TRIGGER } by;  ///< what needs it
};

/// Whether a needed device is set.
static int check_given(const struct check *self, const struct place *place) {
    static const char *const what[] = {"a GPIO line", "the profile ", "rig.trigger = yes"};
    char value[VALUE_BYTES];
    const size_t key = key_of("", place->key);
    config_key_print(self->config, key, value, sizeof value);
    if (strcmp(value, "none") != 0) {
        return 0;
    }
    // Where no line sets it to "none", the message is about the line that needs it.
    const bool by_trigger = place->by == BY_TRIGGER && self->lines[key] == 0;
    show_key(self, by_trigger ? key_of(CONFIG_RIG, "trigger") : key);
    return message_set(self->message, ERROR_MISSING,
                       "%s%s requires \"%s\" to be set with backend = linux", what[place->by],
                       place->by == BY_PROFILE ? self->config->profile.name : "", place->key);
}

/// Whether two needed devices differ.
static int check_different(const struct check *self, const struct place *place,
                           const struct place *before) {
    char value[VALUE_BYTES], other[VALUE_BYTES];
    const size_t key = key_of("", place->key), key_before = key_of("", before->key);
    config_key_print(self->config, key, value, sizeof value);
    config_key_print(self->config, key_before, other, sizeof other);
    if (strcmp(value, other) != 0) {
        return 0;
    }
    // Where a line has set only one of them, the message starts with that one.
    const bool swap = self->lines[key] == 0 && self->lines[key_before] != 0;
    show_key(self, swap ? key_before : key);
    return message_set(self->message, ERROR_DUPLICATE, "%s = %s: already used by %s",
                       swap ? before->key : place->key, value, swap ? place->key : before->key);
}

static int check_places(const struct check *self, const struct place *places, size_t count) {
    for (size_t i = 0; i < count; i++) {
        int error = places[i].needed ? check_given(self, &places[i]) : 0;
        for (size_t k = 0; k < i && places[i].needed && error == 0; k++) {
            error = places[k].needed ? check_different(self, &places[i], &places[k]) : 0;
        }
        if (error != 0) {
            return error;
        }
    }
    return 0;
}

static int check_devices(const struct check *self) {
    const struct config *config = self->config;
    const struct rig_profile *profile = &config->profile;
    const bool reset = config->reset_line != CONFIG_NO_LINE;
    const bool irq = config->irq_line != CONFIG_NO_LINE;
    const bool power = config->lens_power_line != CONFIG_NO_LINE;
    const bool trigger = config->trigger_line != CONFIG_NO_LINE;
    const struct place devices[] = {
        {profile->bridge, "i2c", BY_PROFILE},
        {true, "left_camera", BY_PROFILE},
        {!profile->bridge, "right_camera", BY_PROFILE},
        {profile->lenses != RIG_LENSES_FIXED, "lens_uart", BY_PROFILE},
        {reset || irq || power || trigger, "gpio_chip", BY_LINE},
        {config->console[0] != '\0' && strcmp(config->console, "stdio") != 0, "console", BY_LINE},
        {config->watchdog[0] != '\0', "watchdog", BY_LINE},
    };
    const struct place lines[] = {{reset, "reset_line", BY_LINE},
                                  {irq, "irq_line", BY_LINE},
                                  {power, "lens_power_line", BY_LINE},
                                  {trigger || profile->trigger, "trigger_line", BY_TRIGGER}};
    const int error = check_places(self, devices, sizeof devices / sizeof devices[0]);
    return error != 0 ? error : check_places(self, lines, sizeof lines / sizeof lines[0]);
}

// ---- all

/// Faults of a part that the settings do not use would never occur.
static int check_parts(const struct check *self, const struct fault_plan *plan) {
    const struct config *config = self->config;
    const struct rig_profile *profile = &config->profile;
    const bool lines = config->reset_line != CONFIG_NO_LINE || config->irq_line != CONFIG_NO_LINE ||
                       config->lens_power_line != CONFIG_NO_LINE ||
                       config->trigger_line != CONFIG_NO_LINE;
    const struct {
        const char *name;
        bool there;
        const char *why;
    } parts[] = {
        {"i2c", profile->bridge, "rig.bridge = no"},
        {"right", !profile->bridge, "rig.bridge = yes, where both cameras are \"left\""},
        {"gpio", config->backend != CONFIG_BACKEND_LINUX || lines, "no GPIO line set"},
        {"uart", profile->lenses != RIG_LENSES_FIXED, "rig.lenses = fixed"},
        {"store", config->store[0] != '\0', "store = none"},
        {"watchdog", config->watchdog[0] != '\0', "watchdog = none"},
    };
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        if (!parts[i].there && fault_plan_names(plan, parts[i].name)) {
            show_key(self, key_of("", "faults"));
            return message_set(self->message, ERROR_MISSING, "faults: no part \"%s\" (%s)",
                               parts[i].name, parts[i].why);
        }
    }
    return 0;
}

static int check_faults(const struct check *self) {
    struct fault_plan plan;
    struct message inner;
    const int error = fault_plan_parse(&plan, self->config->faults, &inner);
    if (error == 0) {
        return check_parts(self, &plan);
    }
    show_key(self, key_of("", "faults"));
    return message_set(self->message, error, "faults: %.900s", inner.text);
}

static int check_speed(const struct check *self) {
    const uint32_t baud = self->config->console_baud;
    if (serial_device_has_speed(baud)) {
        return 0;
    }
    show_key(self, key_of("", "console_baud"));
    return message_set(self->message, ERROR_ARGUMENT,
                       "console_baud = %u: not a serial baud rate (expected " SERIAL_DEVICE_SPEEDS
                       ")",
                       (unsigned)baud);
}

/// There must be a way to give a command.
static int check_ways_in(const struct check *self) {
    const struct config *config = self->config;
    if (config->socket[0] != '\0' || config->tcp_port != 0 || config->console[0] != '\0') {
        return 0;
    }
    show_key(self, key_of("", "socket"));
    return message_set(self->message, ERROR_MISSING,
                       "no way to give commands: set socket, tcp_port or console");
}

/// Settings are restored from the store.
static int check_store(const struct check *self) {
    const struct config *config = self->config;
    if (!config->restore || config->store[0] != '\0') {
        return 0;
    }
    const size_t restore = key_of("", "restore");
    show_key(self, self->lines[restore] != 0 ? restore : key_of("", "store"));
    return message_set(self->message, ERROR_MISSING, "restore = yes requires \"store\" to be set");
}

/// Resolves links and dots of a path. A part that does not exist yet stays unresolved.
static void resolve(const char *path, char resolved[PATH_MAX]) {
    char next[PATH_MAX + CONFIG_TEXT_BYTES];
    if (path[0] == '/' || getcwd(resolved, PATH_MAX) == NULL || strcmp(resolved, "/") == 0) {
        resolved[0] = '\0';
    }
    while (*path != '\0') {
        const size_t bytes = strcspn(path, "/");
        if (bytes == 2 && memcmp(path, "..", bytes) == 0) {
            char *slash = strrchr(resolved, '/');
            resolved[slash != NULL ? slash - resolved : 0] = '\0';
        } else if (bytes > 0 && !(bytes == 1 && *path == '.')) {
            snprintf(next, sizeof next, "%s/%.*s", resolved, (int)bytes, path);
            if (realpath(next, resolved) == NULL) {
                snprintf(resolved, PATH_MAX, "%.*s", PATH_MAX - 1, next);
            }
        }
        path += bytes + (path[bytes] == '/');
    }
}

/// Clients may read and replace everything in "files": "store" and the token must be outside of it,
/// and "files" outside of "store".
static int check_apart(const struct check *self) {
    const struct config *config = self->config;
    const struct {
        const char *key, *path, *outer_key, *outer;
    } pairs[] = {{"store", config->store, "files", config->files},
                 {"files", config->files, "store", config->store},
                 {"tcp_token", config->tcp_token, "files", config->files}};
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        char path[PATH_MAX];
        char outer[PATH_MAX];
        if (pairs[i].path[0] == '\0' || pairs[i].outer[0] == '\0') {
            continue;
        }
        resolve(pairs[i].path, path);
        resolve(pairs[i].outer, outer);
        const size_t length = strlen(outer);
        if (strncmp(path, outer, length) == 0 && (path[length] == '/' || path[length] == '\0')) {
            const size_t key = key_of("", pairs[i].key);
            show_key(self, self->lines[key] != 0 ? key : key_of("", pairs[i].outer_key));
            return message_set(
                self->message, ERROR_ARGUMENT,
                "%s = %s is inside %s = %s: use separate directories, because clients can replace "
                "anything in \"files\"",
                pairs[i].key, pairs[i].path, pairs[i].outer_key, pairs[i].outer);
        }
    }
    return 0;
}

/// Replay finds a built-in profile by its name.
static int check_name(const struct check *self) {
    const struct config *config = self->config;
    const size_t key = key_of(CONFIG_RIG, "name");
    struct rig_profile other;
    char setting[SETTING_BYTES];
    if (strcmp(config->profile.name, config->like) == 0 ||
        rig_profile_named(config->profile.name, &other) != 0) {
        return 0;
    }
    show_key(self, key);
    print_setting(self, key, setting);
    return message_set(
        self->message, ERROR_ARGUMENT,
        "%s: reserved for the built-in profile (this profile is based on %s: choose another name)",
        setting, config->like);
}

static int check_rig(const struct check *self) {
    struct rig_profile_error profile_error;
    const int error = rig_profile_check(&self->config->profile, &profile_error);
    return error != 0 ? report_profile_error(self, &profile_error) : check_name(self);
}

int config_check_lines(const struct config *config, const int *lines, int *line,
                       struct message *message) {
    const struct check self = {config, lines, line, message, false};
    int error = check_rig(&self);
    if (error == 0 && config->backend == CONFIG_BACKEND_LINUX) {
        error = check_devices(&self);
    }
    error = error != 0 ? error : check_ways_in(&self);
    error = error != 0 ? error : check_speed(&self);
    error = error != 0 ? error : check_store(&self);
    error = error != 0 ? error : check_apart(&self);
    return error != 0 ? error : check_faults(&self);
}

int config_check_profile(const struct config *config, const int *lines, int *line,
                         struct message *message) {
    const struct check self = {config, lines, line, message, true};
    const int error = check_rig(&self);
    // Built-in profiles are valid, so a line is the cause.
    INVARIANT(error == 0 || *line != 0);
    return error;
}

int config_check(const struct config *config, struct message *message) {
    const int lines[CONFIG_KEYS_MAX] = {0};
    int line = 0;
    return config_check_lines(config, lines, &line, message);
}

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
    bool in_profile;  ///< keys are called as a profile's file calls them
};

/// The key of this name behind a prefix; there is one.
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

/// "rig.width_px 4000".
static void print_setting(const struct check *self, size_t key, char text[SETTING_BYTES]) {
    char value[VALUE_BYTES];
    size_t count = 0;
    config_key_print(self->config, key, value, sizeof value);
    snprintf(text, SETTING_BYTES, "%s %s",
             config_key_called(&config_keys(&count)[key], self->in_profile), value);
}

/// The message begins with this key.
static void blame(const struct check *self, size_t key) {
    if (self->lines[key] != 0) {
        *self->line = self->lines[key];
    }
}

// ---- the profile

/// "an even number from 16 to 2048 px", "no".
static void print_range(const struct rig_profile_flaw *flaw, char text[RANGE_BYTES]) {
    size_t count = 0;
    const struct config_key *key = &config_keys(&count)[key_of(CONFIG_RIG, flaw->field)];
    const char *unit = key->unit != NULL ? key->unit : "";
    const char *blank = key->unit != NULL ? " " : "";
    char word[COMMAND_CHOICE_MAX];
    if (key->choices != NULL) {
        const bool found = command_words_choice_at(key->choices, flaw->least, word);
        INVARIANT(found);
        snprintf(text, RANGE_BYTES, "%s", word);
    } else if (flaw->least == flaw->most) {
        snprintf(text, RANGE_BYTES, "%d%s%s", (int)flaw->least, blank, unit);
    } else {
        snprintf(text, RANGE_BYTES, "%s from %d to %d%s%s",
                 flaw->other  ? "another one"
                 : flaw->even ? "an even number"
                              : "a number",
                 (int)flaw->least, (int)flaw->most, blank, unit);
    }
}

/// The field, or where no line has set it, a cause that a line has set.
static int tell_flaw(const struct check *self, const struct rig_profile_flaw *flaw) {
    const size_t field = key_of(CONFIG_RIG, flaw->field);
    char range[RANGE_BYTES];
    char setting[SETTING_BYTES];
    char causes[RIG_PROFILE_CAUSES * SETTING_BYTES] = "";
    print_range(flaw, range);
    for (size_t i = 0; i < RIG_PROFILE_CAUSES && flaw->causes[i] != NULL; i++) {
        const size_t cause = key_of(CONFIG_RIG, flaw->causes[i]);
        char other[SETTING_BYTES];
        print_setting(self, cause, other);
        if (self->lines[field] == 0 && self->lines[cause] != 0) {
            blame(self, cause);
            print_setting(self, field, setting);
            return message_set(self->message, ERROR_RANGE,
                               "%s does not go with %s, which must be %s", other, setting, range);
        }
        const size_t used = strlen(causes);
        snprintf(causes + used, sizeof causes - used, "%s%s", i == 0 ? "" : " and ", other);
    }
    blame(self, field);
    print_setting(self, field, setting);
    return message_set(self->message, ERROR_RANGE, "%s %s%s: it must be %s", setting,
                       causes[0] != '\0' ? "does not go with " : "is wrong", causes, range);
}

// ---- what the instrument hangs on

/// What two devices or lines have in common.
struct place {
    bool needed;
    const char *key;
    enum { BY_LINE, BY_PROFILE, BY_TRIGGER } by;  ///< who asks for it
};

static int check_places(const struct check *self, const struct place *places, size_t count) {
    for (size_t i = 0; i < count; i++) {
        char value[VALUE_BYTES];
        const size_t key = key_of("", places[i].key);
        config_key_print(self->config, key, value, sizeof value);
        if (places[i].needed && strcmp(value, "none") == 0) {
            // Where no line says "none", what asks for it is the one.
            const bool by_trigger = places[i].by == BY_TRIGGER && self->lines[key] == 0;
            blame(self, by_trigger ? key_of(CONFIG_RIG, "trigger") : key);
            static const char *const who[] = {"a line of GPIO", "the profile ", "rig.trigger yes"};
            return message_set(self->message, ERROR_MISSING,
                               "%s is none, but %s%s needs it with backend = linux", places[i].key,
                               who[places[i].by],
                               places[i].by == BY_PROFILE ? self->config->profile.name : "");
        }
        for (size_t k = 0; k < i && places[i].needed; k++) {
            char other[VALUE_BYTES];
            const size_t before = key_of("", places[k].key);
            config_key_print(self->config, before, other, sizeof other);
            if (!places[k].needed || strcmp(value, other) != 0) {
                continue;
            }
            // Where a line has set one of them alone, it is the one.
            const bool swap = self->lines[key] == 0 && self->lines[before] != 0;
            blame(self, swap ? before : key);
            return message_set(self->message, ERROR_DUPLICATE,
                               "%s %s is also %s: each needs one of its own",
                               places[swap ? k : i].key, value, places[swap ? i : k].key);
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

/// A part that the settings do without: its faults would never be seen.
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
        {"i2c", profile->bridge, "rig.bridge no"},
        {"right", !profile->bridge, "rig.bridge yes, behind which both cameras are \"left\""},
        {"gpio", config->backend != CONFIG_BACKEND_LINUX || lines, "no line of GPIO"},
        {"uart", profile->lenses != RIG_LENSES_FIXED, "rig.lenses fixed"},
        {"store", config->store[0] != '\0', "store none"},
        {"watchdog", config->watchdog[0] != '\0', "watchdog none"},
    };
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        if (!parts[i].there && fault_plan_names(plan, parts[i].name)) {
            blame(self, key_of("", "faults"));
            return message_set(self->message, ERROR_MISSING,
                               "faults: there is no part \"%s\" with %s", parts[i].name,
                               parts[i].why);
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
    blame(self, key_of("", "faults"));
    return message_set(self->message, error, "faults: %.900s", inner.text);
}

static int check_speed(const struct check *self) {
    const uint32_t baud = self->config->console_baud;
    if (serial_device_has_speed(baud)) {
        return 0;
    }
    blame(self, key_of("", "console_baud"));
    return message_set(
        self->message, ERROR_ARGUMENT,
        "console_baud %u is no speed of a serial line: there are " SERIAL_DEVICE_SPEEDS,
        (unsigned)baud);
}

/// Somebody must be able to give a command.
static int check_ways_in(const struct check *self) {
    const struct config *config = self->config;
    if (config->socket[0] != '\0' || config->tcp_port != 0 || config->console[0] != '\0') {
        return 0;
    }
    blame(self, key_of("", "socket"));
    return message_set(self->message, ERROR_MISSING,
                       "socket, tcp_port and console are none: nobody could give a command");
}

/// What is to be restored is kept in the store.
static int check_store(const struct check *self) {
    const struct config *config = self->config;
    if (!config->restore || config->store[0] != '\0') {
        return 0;
    }
    const size_t restore = key_of("", "restore");
    blame(self, self->lines[restore] != 0 ? restore : key_of("", "store"));
    return message_set(self->message, ERROR_MISSING,
                       "restore yes needs a store, which is none: there is nothing to restore");
}

/// Where a path leads: without links and dots. What does not exist yet stands there as it is
/// written.
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

/// Clients may read and replace what is in "files": nothing else may be there, and not that in
/// turn.
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
            blame(self, self->lines[key] != 0 ? key : key_of("", pairs[i].outer_key));
            return message_set(
                self->message, ERROR_ARGUMENT,
                "%s = %s is inside %s = %s: clients can replace what is in \"files\": "
                "give them separate directories",
                pairs[i].key, pairs[i].path, pairs[i].outer_key, pairs[i].outer);
        }
    }
    return 0;
}

/// Whoever plays a recording finds a built-in profile by its name.
static int check_name(const struct check *self) {
    const struct config *config = self->config;
    const size_t key = key_of(CONFIG_RIG, "name");
    struct rig_profile other;
    char setting[SETTING_BYTES];
    if (strcmp(config->profile.name, config->like) == 0 ||
        rig_profile_named(config->profile.name, &other) != 0) {
        return 0;
    }
    blame(self, key);
    print_setting(self, key, setting);
    return message_set(self->message, ERROR_ARGUMENT,
                       "%s: that is another profile, and this one is like %s: give it a name of "
                       "its own",
                       setting, config->like);
}

static int check_rig(const struct check *self) {
    struct rig_profile_flaw flaw;
    const int error = rig_profile_check(&self->config->profile, &flaw);
    return error != 0 ? tell_flaw(self, &flaw) : check_name(self);
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
    // What is built in is good, so a line has done it.
    INVARIANT(error == 0 || *line != 0);
    return error;
}

int config_check(const struct config *config, struct message *message) {
    const int lines[CONFIG_KEYS_MAX] = {0};
    int line = 0;
    return config_check_lines(config, lines, &line, message);
}

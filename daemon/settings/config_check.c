// SPDX-License-Identifier: Apache-2.0
// Consistency of settings.
#include <arpa/inet.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/serial_device.h"
#include "daemon/settings/config.h"
#include "daemon/settings/config_keys.h"
#include "daemon/settings/fault_plan.h"

enum { SETTING_BYTES = CONFIG_VALUE_BYTES + 64, NAMES_MAX = RIG_PROFILE_CAUSES + 1 };

/// What a check needs.
struct check {
    const struct config *config;
    const struct config_line *lines;  ///< NULL: not known
    struct message *message;
};

/// Index of an existing key.
static size_t key_of(const char *name) {
    size_t count = 0, i = 0;
    const struct config_key *keys = config_keys(&count);
    while (i < count && strcmp(keys[i].name, name) != 0) {
        i++;
    }
    INVARIANT(i < count);
    return i;
}

/// Index of the key of a profile's field.
static size_t key_of_field(const char *field) {
    char name[CONFIG_CALLED_BYTES];
    snprintf(name, sizeof name, CONFIG_RIG "%s", field);
    return key_of(name);
}

/// Puts the line of the first of these keys that has one in front of the message.
static int at_key(const struct check *self, int error, const size_t *keys, size_t count) {
    for (size_t i = 0; i < count && self->lines != NULL; i++) {
        if (self->lines[keys[i]].number != 0) {
            return config_line_error(&self->lines[keys[i]], error, self->message);
        }
    }
    return error;
}

/// The same for one or two (`other` not NULL) names.
static int at(const struct check *self, int error, const char *name, const char *other) {
    const size_t keys[] = {key_of(name), key_of(other != NULL ? other : name)};
    return at_key(self, error, keys, 2);
}

/// "rig.width = 4000 px".
static void print_setting(const struct check *self, size_t key, char text[SETTING_BYTES]) {
    char value[CONFIG_VALUE_BYTES];
    config_key_print(self->config, key, value, sizeof value);
    snprintf(text, SETTING_BYTES, "%s = %s", config_key_name(key), value);
}

// ---- the profile

/// "an even number, 16 to 2048 px", "no".
static void print_range(const struct rig_profile_error *profile_error, char *text, size_t bytes) {
    size_t count = 0;
    const struct config_key *key = &config_keys(&count)[key_of_field(profile_error->field)];
    char range[QUANTITY_RANGE_BYTES];
    if (key->choices != NULL) {
        const bool found = command_words_choice_at(key->choices, profile_error->min, range);
        INVARIANT(found);
    } else if (profile_error->min == profile_error->max) {
        quantity_print(key->quantity, profile_error->min, range);
    } else {
        quantity_print_range(key->quantity, profile_error->min, profile_error->max, range);
    }
    const char *kind = "";
    if (profile_error->other) {
        kind = "a different one, ";
    } else if (profile_error->even) {
        kind = "an even number, ";
    }
    snprintf(text, bytes, "%s%s", kind, range);
}

static int check_profile(const struct check *self) {
    struct rig_profile_error profile_error;
    char range[QUANTITY_RANGE_BYTES + 32], setting[SETTING_BYTES];
    char causes[RIG_PROFILE_CAUSES * SETTING_BYTES] = "";
    size_t keys[NAMES_MAX];
    size_t count = 1;
    const int error = rig_profile_check(&self->config->profile, &profile_error);
    if (error == ERROR_OK) {
        return 0;
    }
    keys[0] = key_of_field(profile_error.field);
    print_range(&profile_error, range, sizeof range);
    print_setting(self, keys[0], setting);
    for (size_t i = 0; i < RIG_PROFILE_CAUSES && profile_error.causes[i] != NULL; i++) {
        char other[SETTING_BYTES];
        const size_t used = strlen(causes);
        keys[count++] = key_of_field(profile_error.causes[i]);
        print_setting(self, keys[count - 1], other);
        snprintf(causes + used, sizeof causes - used, "%s%s", i == 0 ? "" : " and ", other);
    }
    message_set(self->message, error, "%s%s%s (expected %s)", setting,
                count > 1 ? " conflicts with " : ": out of range", causes, range);
    return at_key(self, error, keys, count);
}

/// Replay finds a built-in profile by its name.
static int check_name(const struct check *self) {
    const struct config *config = self->config;
    struct rig_profile other;
    if (strcmp(config->profile.name, config->like) == 0 ||
        rig_profile_named(config->profile.name, &other) != 0) {
        return ERROR_OK;
    }
    message_set(self->message, ERROR_ARGUMENT,
                CONFIG_RIG
                "name = %s: reserved for the built-in profile (this profile is based on "
                "%s: choose another name)",
                config->profile.name, config->like);
    return at(self, ERROR_ARGUMENT, CONFIG_RIG "name", NULL);
}

// ---- devices of the instrument

/// A device or a GPIO line.
struct place {
    bool needed;
    const char *key;
    enum { BY_LINE, BY_PROFILE, BY_TRIGGER } by;  ///< what needs it
};

/// Whether needed devices are set, and differ.
static int check_places(const struct check *self, const struct place *places, size_t count) {
    static const char *const what[] = {"a GPIO line", "the profile ", CONFIG_RIG "trigger = yes"};
    char values[8][CONFIG_VALUE_BYTES];
    INVARIANT(count <= 8);
    for (size_t i = 0; i < count; i++) {
        const struct place *place = &places[i];
        config_key_print(self->config, key_of(place->key), values[i], sizeof values[i]);
        if (place->needed && strcmp(values[i], "none") == 0) {
            message_set(self->message, ERROR_MISSING,
                        "%s%s requires \"%s\" to be set with backend = linux", what[place->by],
                        place->by == BY_PROFILE ? self->config->profile.name : "", place->key);
            return at(self, ERROR_MISSING, place->key,
                      place->by == BY_TRIGGER ? CONFIG_RIG "trigger" : NULL);
        }
        for (size_t k = 0; k < i && place->needed; k++) {
            if (places[k].needed && strcmp(values[i], values[k]) == 0) {
                message_set(self->message, ERROR_DUPLICATE,
                            "%s and %s are both %s (expected different ones)", places[k].key,
                            place->key, values[i]);
                return at(self, ERROR_DUPLICATE, place->key, places[k].key);
            }
        }
    }
    return ERROR_OK;
}

static int check_devices(const struct check *self) {
    const struct config *config = self->config;
    const struct rig_profile *profile = &config->profile;
    const bool reset = config->reset_line != CONFIG_NO_LINE;
    const bool irq = config->irq_line != CONFIG_NO_LINE;
    const bool power = config->lens_power_line != CONFIG_NO_LINE;
    const bool trigger = config->trigger_line != CONFIG_NO_LINE;
    const struct place devices[] = {
        {rig_needs_i2c(profile), "i2c", BY_PROFILE},
        {true, "left_camera", BY_PROFILE},
        {!profile->bridge, "right_camera", BY_PROFILE},
        {rig_needs_lens_uart(profile), "lens_uart", BY_PROFILE},
        {reset || irq || power || trigger, "gpio_chip", BY_LINE},
        {config->console[0] != '\0' && strcmp(config->console, "stdio") != 0, "console", BY_LINE},
        {config->watchdog[0] != '\0', "watchdog", BY_LINE},
    };
    const struct place lines[] = {{reset, "reset_line", BY_LINE},
                                  {irq, "irq_line", BY_LINE},
                                  {power, "lens_power_line", BY_LINE},
                                  {trigger || profile->trigger, "trigger_line", BY_TRIGGER}};
    if (config->backend != CONFIG_BACKEND_LINUX) {
        return ERROR_OK;
    }
    const int error = check_places(self, devices, sizeof devices / sizeof devices[0]);
    return error != ERROR_OK ? error : check_places(self, lines, sizeof lines / sizeof lines[0]);
}

// ---- the rest

/// Faults of a part that the settings do not use would never occur.
static int check_faults(const struct check *self) {
    const struct config *config = self->config;
    const struct rig_profile *profile = &config->profile;
    const bool gpio = config->backend != CONFIG_BACKEND_LINUX ||
                      config->reset_line != CONFIG_NO_LINE || config->irq_line != CONFIG_NO_LINE ||
                      config->lens_power_line != CONFIG_NO_LINE ||
                      config->trigger_line != CONFIG_NO_LINE;
    const struct {
        const char *name;
        bool there;
        const char *why;
    } parts[] = {
        {"i2c", rig_needs_i2c(profile), "rig.bridge = no"},
        {"right", !profile->bridge, "rig.bridge = yes, where both cameras are \"left\""},
        {"gpio", gpio, "no GPIO line set"},
        {"uart", rig_needs_lens_uart(profile),
         profile->lens_driver == NULL ? "rig.lenses = fixed" : "the lens controller is on I2C"},
        {"store", config->store[0] != '\0', "store = none"},
        {"watchdog", config->watchdog[0] != '\0', "watchdog = none"},
    };
    struct fault_plan plan;
    struct message why;
    int error = fault_plan_parse(&plan, config->faults, &why);
    for (size_t i = 0; i < sizeof parts / sizeof parts[0] && error == ERROR_OK; i++) {
        if (!parts[i].there && fault_plan_names(&plan, parts[i].name)) {
            error = message_set(&why, ERROR_MISSING, "no part \"%s\" (%s)", parts[i].name,
                                parts[i].why);
        }
    }
    if (error != ERROR_OK) {
        message_set(self->message, error, "faults: %.900s", why.text);
        return at(self, error, "faults", NULL);
    }
    return 0;
}

static int check_speed(const struct check *self) {
    const uint32_t baud = self->config->console_baud;
    if (serial_device_has_speed(baud)) {
        return ERROR_OK;
    }
    message_set(self->message, ERROR_ARGUMENT,
                "console_baud = %u: not a serial baud rate (expected " SERIAL_DEVICE_SPEEDS ")",
                (unsigned)baud);
    return at(self, ERROR_ARGUMENT, "console_baud", NULL);
}

/// There must be a way to give a command, and a store to restore from.
static int check_ways(const struct check *self) {
    const struct config *config = self->config;
    if (config->socket[0] == '\0' && config->tcp_port == 0 && config->console[0] == '\0') {
        message_set(self->message, ERROR_MISSING,
                    "no way to give commands: set socket, tcp_port or console");
        return at(self, ERROR_MISSING, "socket", NULL);
    }
    if (config->restore && config->store[0] == '\0') {
        message_set(self->message, ERROR_MISSING, "restore = yes requires \"store\" to be set");
        return at(self, ERROR_MISSING, "restore", "store");
    }
    return ERROR_OK;
}

bool config_parse_network(const char *text, uint32_t *address, uint32_t *mask) {
    enum { BITS_MIN = 8, BITS_MAX = 32 };
    char host[CONFIG_NETWORK_BYTES] = "";
    struct in_addr parsed;
    unsigned bits = 0;
    int used = 0;
    if (sscanf(text, "%15[0-9.]/%2u%n", host, &bits, &used) != 2 || text[used] != '\0' ||
        bits < BITS_MIN || bits > BITS_MAX || inet_pton(AF_INET, host, &parsed) != 1) {
        return false;
    }
    *address = ntohl(parsed.s_addr);
    *mask = UINT32_MAX << (BITS_MAX - bits);
    return (*address & ~*mask) == 0;
}

static int check_network(const struct check *self) {
    const struct config *config = self->config;
    uint32_t address = 0, mask = 0;
    int error = 0;
    if (config->tcp_network[0] == '\0') {
        return ERROR_OK;
    }
    if (!config_parse_network(config->tcp_network, &address, &mask)) {
        error = message_set(self->message, ERROR_ARGUMENT,
                            "tcp_network = %s: not a network (expected ADDRESS/BITS with 8 to 32 "
                            "bits and zeros behind them, such as 192.0.2.0/24)",
                            config->tcp_network);
    } else if (config->tcp_port == 0) {
        error =
            message_set(self->message, ERROR_MISSING,
                        "tcp_network = %s requires \"tcp_port\" to be set", config->tcp_network);
    }
    return error != ERROR_OK ? at(self, error, "tcp_network", NULL) : ERROR_OK;
}

static int check_slots(const struct check *self) {
    const struct config *config = self->config;
    int error = 0;
    if (config->image_slot_2[0] == '\0') {
        return ERROR_OK;
    }
    if (strcmp(config->image_slot, config->image_slot_2) == 0) {
        error = message_set(self->message, ERROR_DUPLICATE,
                            "image_slot and image_slot_2 are both %s (expected different ones)",
                            config->image_slot);
    } else if (config->image_slot[0] == '\0') {
        error = message_set(self->message, ERROR_MISSING,
                            "image_slot_2 = %s requires \"image_slot\" to be set",
                            config->image_slot_2);
    }
    return error != ERROR_OK ? at(self, error, "image_slot_2", NULL) : ERROR_OK;
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
            message_set(
                self->message, ERROR_ARGUMENT,
                "%s = %s is inside %s = %s: use separate directories, because clients can replace "
                "anything in \"files\"",
                pairs[i].key, pairs[i].path, pairs[i].outer_key, pairs[i].outer);
            return at(self, ERROR_ARGUMENT, pairs[i].key, pairs[i].outer_key);
        }
    }
    return ERROR_OK;
}

int config_check_lines(const struct config *config, const struct config_line *lines,
                       bool profile_only, struct message *message) {
    static int (*const checks[])(const struct check *self) = {
        check_profile, check_name,  check_devices, check_ways,  check_speed,
        check_network, check_slots, check_apart,   check_faults};
    const size_t count = profile_only ? 2 : sizeof checks / sizeof checks[0];
    const struct check self = {config, lines, message};
    int error = 0;
    for (size_t i = 0; i < count && error == ERROR_OK; i++) {
        error = checks[i](&self);
    }
    return error;
}

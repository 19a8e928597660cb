// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/config.h"

#include <string.h>

#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/standard_paths.h"
#include "daemon/settings/config_keys.h"
#include "hal/log.h"

static int set_built_in(struct config *config, const char *name) {
    const int error = rig_profile_named(name, &config->profile);
    if (error == ERROR_OK) {
        memcpy(config->like, config->profile.name, sizeof config->like);
        config->profile_file[0] = '\0';
    }
    return error;
}

/// A path that is too long for its setting stays "", and is reported as missing.
static void take_place(char *setting, size_t bytes, const char *place) {
    if (strlen(place) < bytes) {
        memcpy(setting, place, strlen(place) + 1);
    }
}

void config_defaults(struct config *config) {
    struct standard_paths paths;
    *config = (struct config){
        .backend = CONFIG_BACKEND_LINUX,
        .i2c = "/dev/i2c-1",
        .camera = {"/dev/video0", "/dev/video1"},
        .lens_uart = "/dev/ttyS1",
        .gpio_chip = "/dev/gpiochip0",
        .reset_line = CONFIG_NO_LINE,
        .irq_line = CONFIG_NO_LINE,
        .lens_power_line = CONFIG_NO_LINE,
        .trigger_line = CONFIG_NO_LINE,
        .reset_active_low = true,
        .console_baud = 115200,
        .clients = 8,
        .queue = 8,
        .reader_timeout_s = 30,
        .watchdog_s = 60,
        .stuck_s = 20,
        .log_level = HAL_LOG_INFO,
        .confine = true,
    };
    standard_paths_default(&paths);
    take_place(config->socket, sizeof config->socket, paths.socket);
    take_place(config->files, sizeof config->files, paths.files);
    take_place(config->store, sizeof config->store, paths.store);
    take_place(config->log_file, sizeof config->log_file, paths.log);
    const int error = set_built_in(config, "rig");
    INVARIANT(error == ERROR_OK);
}

static int64_t load(const struct config *config, const struct config_key *key) {
    const void *at = (const char *)config + key->offset;
    INVARIANT(key->bytes == 1 || key->bytes == 2 || key->bytes == 4);
    switch (key->bytes) {
        case 1:
            return *(const uint8_t *)at;
        case 2:
            return *(const uint16_t *)at;
        default:
            return *(const int32_t *)at;
    }
}

static void store(struct config *config, const struct config_key *key, int64_t number) {
    char *at = (char *)config + key->offset;
    INVARIANT(key->bytes == 1 || key->bytes == 2 || key->bytes == 4);
    for (int i = 0; i < (key->repeat != 0 ? LENS_AXES : 1); i++, at += key->repeat) {
        if (key->bytes == 1) {
            *(uint8_t *)at = (uint8_t)number;
        } else if (key->bytes == 2) {
            *(uint16_t *)(void *)at = (uint16_t)number;
        } else {
            *(int32_t *)(void *)at = (int32_t)number;
        }
    }
    INVARIANT(load(config, key) == number);
}

int64_t config_key_min(const struct config_key *key) {
    return key->none != NULL ? key->min + 1 : key->min;
}

static int set_number(struct config *config, const struct config_key *key, const char *called,
                      const char *value, bool old, struct message *message) {
    const enum quantity quantity = old ? QUANTITY_NUMBER : key->quantity;
    int64_t number = key->min;
    struct message why;
    if (key->none == NULL || strcmp(value, key->none) != 0) {
        const int error =
            quantity_parse(quantity, value, config_key_min(key), key->max, &number, &why);
        if (error != ERROR_OK) {
            return message_set(message, error, "%s = %s: %.500s%s%s", called, value, why.text,
                               key->none != NULL ? ", or " : "",
                               key->none != NULL ? key->none : "");
        }
    }
    store(config, key, number);
    return ERROR_OK;
}

static int set_text(struct config *config, const struct config_key *key, const char *value,
                    struct message *message) {
    INVARIANT(key->none != NULL && key->bytes <= CONFIG_TEXT_BYTES);
    const char *text = strcmp(value, key->none) == 0 ? "" : value;
    if (strlen(text) >= key->bytes) {
        return message_set(message, ERROR_RANGE, "%s: too long (at most %zu characters)", key->name,
                           key->bytes - 1);
    }
    memcpy((char *)config + key->offset, text, strlen(text) + 1);
    return ERROR_OK;
}

/// unix:PATH or tcp:HOST:PORT.
static bool is_place_of_rig(const char *place) {
    if (strncmp(place, "tcp:", 4) != 0) {
        return strncmp(place, "unix:", 5) == 0 && place[5] != '\0';
    }
    const char *host = place + 4;
    const char *colon = strrchr(host, ':');
    return colon != NULL && colon != host && colon[1] != '\0';
}

static int set_backend(struct config *config, const char *value, struct message *message) {
    static const struct {
        const char *word;
        enum config_backend backend;
        bool place;
    } backends[] = {{"linux", CONFIG_BACKEND_LINUX, false},
                    {"sim", CONFIG_BACKEND_SIM, true},
                    {"replay", CONFIG_BACKEND_REPLAY, true}};
    for (size_t i = 0; i < sizeof backends / sizeof backends[0]; i++) {
        const size_t bytes = strlen(backends[i].word);
        if (strncmp(value, backends[i].word, bytes) != 0 ||
            (value[bytes] != ' ' && value[bytes] != '\0')) {
            continue;
        }
        const char *place = value + bytes + strspn(value + bytes, " \t");
        if ((*place != '\0') != backends[i].place || strlen(place) >= CONFIG_TEXT_BYTES ||
            (backends[i].backend == CONFIG_BACKEND_SIM && !is_place_of_rig(place))) {
            break;
        }
        config->backend = backends[i].backend;
        strcpy(config->backend_address, place);
        return ERROR_OK;
    }
    return message_set(message, ERROR_ARGUMENT,
                       "unknown backend \"%s\" (expected linux, sim unix:PATH, sim tcp:HOST:PORT "
                       "or replay DIRECTORY)",
                       value);
}

static int set_choice(struct config *config, const struct config_key *key, const char *called,
                      const char *value, struct message *message) {
    INVARIANT(key->choices != NULL);
    const int place = command_words_choice(value, key->choices);
    if (place < 0) {
        return message_set(message, ERROR_ARGUMENT, "unknown %s \"%s\" (expected one of: %s)",
                           called, value, key->choices);
    }
    store(config, key, place + key->min);
    return ERROR_OK;
}

static int set_name(struct config *config, const struct config_key *key, const char *called,
                    const char *value, struct message *message) {
    static const char characters[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
    const size_t length = strlen(value);
    if (length >= key->bytes || strspn(value, characters) != length ||
        strchr("-_.", value[0]) != NULL) {
        return message_set(message, ERROR_ARGUMENT,
                           "invalid %s \"%s\" (expected 1 to %zu letters, digits, - _ and ., "
                           "starting with a letter or a digit)",
                           called, value, key->bytes - 1);
    }
    memcpy((char *)config + key->offset, value, length + 1);
    return ERROR_OK;
}

static int set_lenses(struct config *config, const char *called, const char *value,
                      struct message *message) {
    if (rig_profile_set_lenses(&config->profile, value) == 0) {
        return ERROR_OK;
    }
    char names[MESSAGE_BYTES] = RIG_LENSES_FIXED;
    size_t count = 0;
    const struct lens_driver *drivers = lens_drivers(&count);
    for (size_t i = 0, used = strlen(names); i < count && used < sizeof names; i++) {
        used += (size_t)snprintf(names + used, sizeof names - used, " %s", drivers[i].name);
    }
    return message_set(message, ERROR_ARGUMENT, "unknown %s \"%s\" (expected one of: %s)", called,
                       value, names);
}

int config_key_set(struct config *config, const struct config_key *key, const char *called,
                   const char *value, bool old, struct message *message) {
    int error = 0;
    switch (key->kind) {
        case CONFIG_PROFILE:
            error = set_built_in(config, value);
            return error == ERROR_OK
                       ? 0
                       : message_set(message, ERROR_ARGUMENT,
                                     "unknown %s \"%s\" (expected one of: rig two-cameras "
                                     "two-cameras-lens%s)",
                                     called, value,
                                     strcmp(called, key->name) == 0
                                         ? ", or the path of a .profile file"
                                         : "");
        case CONFIG_NAME:
            return set_name(config, key, called, value, message);
        case CONFIG_BACKEND:
            return set_backend(config, value, message);
        case CONFIG_TEXT:
            return set_text(config, key, value, message);
        case CONFIG_LENSES:
            return set_lenses(config, called, value, message);
        case CONFIG_CHOICE:
            return set_choice(config, key, called, value, message);
        case CONFIG_NUMBER:
            break;
    }
    return set_number(config, key, called, value, old, message);
}

int config_set(struct config *config, const char *name, const char *value,
               struct message *message) {
    bool old = false;
    struct suggest suggest;
    const struct config_key *key = config_key_find(name, false, &old, &suggest);
    if (key == NULL) {
        return message_set(message, ERROR_ARGUMENT, "unknown key \"%s\"%s", name, suggest.text);
    }
    old = config_key_is_old(key, old, value);
    return config_key_set(config, key, name, value, old, message);
}

size_t config_key_count(void) {
    size_t count = 0;
    config_keys(&count);
    return count;
}

const char *config_key_name(size_t index) {
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    INVARIANT(index < count);
    return keys[index].name;
}

bool config_key_is_of_rig(size_t index) {
    return strncmp(config_key_name(index), CONFIG_RIG, strlen(CONFIG_RIG)) == 0;
}

void config_key_print(const struct config *config, size_t index, char *text, size_t bytes) {
    static const char *const backends[] = {
        [CONFIG_BACKEND_SIM] = "sim", [CONFIG_BACKEND_LINUX] = "linux", "replay"};
    size_t count = 0;
    const struct config_key *key = &config_keys(&count)[index];
    INVARIANT(index < count);
    const char *place = (const char *)config + key->offset;
    char number[QUANTITY_BYTES];
    switch (key->kind) {
        case CONFIG_PROFILE:
            snprintf(text, bytes, "%s",
                     config->profile_file[0] != '\0' ? config->profile_file : config->like);
            break;
        case CONFIG_BACKEND:
            snprintf(text, bytes, "%s%s%s", backends[config->backend],
                     config->backend_address[0] != '\0' ? " " : "", config->backend_address);
            break;
        case CONFIG_NAME:
        case CONFIG_TEXT:
            snprintf(text, bytes, "%s", place[0] != '\0' ? place : key->none);
            break;
        case CONFIG_LENSES:
            snprintf(text, bytes, "%s",
                     config->profile.lens_driver != NULL ? config->profile.lens_driver->name
                                                         : RIG_LENSES_FIXED);
            break;
        case CONFIG_CHOICE:
            command_words_choice_at(key->choices, (int)(load(config, key) - key->min), number);
            snprintf(text, bytes, "%s", number);
            break;
        case CONFIG_NUMBER:
            quantity_print(key->quantity, load(config, key), number);
            snprintf(text, bytes, "%s",
                     key->none != NULL && load(config, key) == key->min ? key->none : number);
            break;
    }
}

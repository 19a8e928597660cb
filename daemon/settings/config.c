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
    const int error = rig_profile_named(name, &config->base);
    if (error == 0) {
        config->profile = config->base;
        memcpy(config->like, config->base.name, sizeof config->like);
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
    INVARIANT(error == 0);
}

void config_take_profile(struct config *config, const struct config *from) {
    config->base = from->base;
    config->profile = from->base;
    memcpy(config->like, from->like, sizeof config->like);
    memcpy(config->profile_file, from->profile_file, sizeof config->profile_file);
}

static int64_t load(const struct config *config, const struct config_key *key) {
    const unsigned char *at = (const unsigned char *)config + key->offset;
    if (key->bytes == 1) {
        return *at;
    }
    if (key->bytes == 2) {
        uint16_t value;
        memcpy(&value, at, sizeof value);
        return value;
    }
    INVARIANT(key->bytes == 4);
    int32_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static void store(struct config *config, const struct config_key *key, int64_t number) {
    unsigned char *at = (unsigned char *)config + key->offset;
    const uint8_t one = (uint8_t)number;
    const uint16_t two = (uint16_t)number;
    const uint32_t four = (uint32_t)number;
    INVARIANT(key->bytes == 1 || key->bytes == 2 || key->bytes == 4);
    memcpy(at,
           key->bytes == 1   ? (const void *)&one
           : key->bytes == 2 ? (const void *)&two
                             : &four,
           key->bytes);
}

/// The smallest number of a key; `min` itself has a word where there is one.
static int64_t min_number(const struct config_key *key) {
    return key->none != NULL ? key->min + 1 : key->min;
}

/// Why a number was rejected, and what is expected.
static int reject_number(const struct config_key *key, enum quantity quantity, const char *called,
                         const char *value, enum quantity_result result, struct message *message) {
    const char *unit = quantity_unit(quantity);
    const char *or_word = key->none != NULL ? ", or " : "";
    const char *word = key->none != NULL ? key->none : "";
    char range[QUANTITY_RANGE_BYTES], step[QUANTITY_BYTES];
    quantity_print_range(quantity, min_number(key), key->max, range);
    quantity_print(quantity, 1, step);
    switch (result) {
        case QUANTITY_UNIT_MISSING:
            return message_set(message, ERROR_SYNTAX, "%s = %s: unit missing (expected %s)", called,
                               value, unit);
        case QUANTITY_UNIT_UNKNOWN:
            return message_set(message, ERROR_SYNTAX, "%s = %s: unknown unit (expected %s)", called,
                               value, unit);
        case QUANTITY_OUT_OF_RANGE:
            return message_set(message, ERROR_RANGE, "%s = %s: out of range (expected %s%s%s)",
                               called, value, range, or_word, word);
        case QUANTITY_NOT_A_STEP:
            return message_set(message, ERROR_RANGE, "%s = %s: not a multiple of %s", called, value,
                               step);
        case QUANTITY_GOOD:
        case QUANTITY_NOT_A_NUMBER:
            break;
    }
    return message_set(message, ERROR_SYNTAX, "%s = %s: not %s (expected %s%s%s)", called, value,
                       *unit != '\0' ? "a number of up to 6 decimals" : "an integer", range,
                       or_word, word);
}

static int set_number(struct config *config, const struct config_key *key, const char *called,
                      const char *value, bool old, struct message *message) {
    const enum quantity quantity = old ? QUANTITY_NUMBER : key->quantity;
    int64_t number = key->min;
    if (key->none == NULL || strcmp(value, key->none) != 0) {
        const enum quantity_result result =
            quantity_parse(quantity, value, min_number(key), key->max, &number);
        if (result != QUANTITY_GOOD) {
            return reject_number(key, quantity, called, value, result, message);
        }
    }
    store(config, key, number);
    return 0;
}

static int set_text(struct config *config, const struct config_key *key, const char *value,
                    struct message *message) {
    const char *text = strcmp(value, key->none) == 0 ? "" : value;
    if (strlen(text) >= key->bytes) {
        return message_set(message, ERROR_RANGE, "%s: too long (at most %zu characters)", key->name,
                           key->bytes - 1);
    }
    memcpy((char *)config + key->offset, text, strlen(text) + 1);
    return 0;
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
        return 0;
    }
    return message_set(message, ERROR_ARGUMENT,
                       "unknown backend \"%s\" (expected linux, sim unix:PATH, sim tcp:HOST:PORT "
                       "or replay DIRECTORY)",
                       value);
}

static int set_choice(struct config *config, const struct config_key *key, const char *called,
                      const char *value, struct message *message) {
    const int place = command_words_choice(value, key->choices);
    if (place < 0) {
        return message_set(message, ERROR_ARGUMENT, "unknown %s \"%s\" (expected one of: %s)",
                           called, value, key->choices);
    }
    store(config, key, place + key->min);
    return 0;
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
    return 0;
}

int config_key_set(struct config *config, const struct config_key *key, const char *called,
                   const char *value, bool old, struct message *message) {
    int error = 0;
    switch (key->kind) {
        case CONFIG_PROFILE:
            error = set_built_in(config, value);
            return error == 0 ? 0
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
        case CONFIG_CHOICE:
            error = set_choice(config, key, called, value, message);
            if (error == 0 && key->kind == CONFIG_LENSES) {
                rig_profile_set_lenses(&config->profile, config->profile.lenses);
            }
            return error;
        case CONFIG_NUMBER:
            break;
    }
    return set_number(config, key, called, value, old, message);
}

int config_set(struct config *config, const char *name, const char *value,
               struct message *message) {
    bool old = false;
    const char *nearest = NULL;
    const struct config_key *key = config_key_find(name, false, &old, &nearest);
    if (key == NULL) {
        return message_set(message, ERROR_ARGUMENT, "unknown key \"%s\"", name);
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

static void print_number(const struct config *config, const struct config_key *key, char *text,
                         size_t bytes) {
    char number[QUANTITY_BYTES];
    const int64_t value = load(config, key);
    const bool none = key->none != NULL && value == key->min;
    if (!none) {
        quantity_print(key->quantity, value, number);
    }
    snprintf(text, bytes, "%s", none ? key->none : number);
}

void config_key_print(const struct config *config, size_t index, char *text, size_t bytes) {
    static const char *const backends[] = {
        [CONFIG_BACKEND_SIM] = "sim", [CONFIG_BACKEND_LINUX] = "linux", "replay"};
    size_t count = 0;
    const struct config_key *key = &config_keys(&count)[index];
    INVARIANT(index < count);
    const char *place = (const char *)config + key->offset;
    char word[COMMAND_CHOICE_MAX];
    switch (key->kind) {
        case CONFIG_PROFILE:
            snprintf(text, bytes, "%s",
                     config->profile_file[0] != '\0' ? config->profile_file : config->like);
            break;
        case CONFIG_NAME:
            snprintf(text, bytes, "%s", place);
            break;
        case CONFIG_BACKEND:
            snprintf(text, bytes, "%s%s%s", backends[config->backend],
                     config->backend_address[0] != '\0' ? " " : "", config->backend_address);
            break;
        case CONFIG_TEXT:
            snprintf(text, bytes, "%s", place[0] != '\0' ? place : key->none);
            break;
        case CONFIG_LENSES:
        case CONFIG_CHOICE:
            command_words_choice_at(key->choices, (int)(load(config, key) - key->min), word);
            snprintf(text, bytes, "%s", word);
            break;
        case CONFIG_NUMBER:
            print_number(config, key, text, bytes);
            break;
    }
}

void config_comment_print(FILE *file, const char *text) {
    size_t column = 0;
    for (const char *at = text; *at != '\0';) {
        at += strspn(at, " ");
        const size_t word = strcspn(at, " ");
        if (column == 0 || column + 1 + word > 98) {
            column = (size_t)fprintf(file, "%s#", column == 0 ? "" : "\n") - (column != 0);
        }
        column += (size_t)fprintf(file, " %.*s", (int)word, at);
        at += word;
    }
    fputc('\n', file);
}

void config_key_describe(const struct config_key *key, char *text, size_t bytes) {
    size_t length = (size_t)snprintf(text, bytes, "%s", key->help);
    INVARIANT(length < bytes);
    if (key->kind == CONFIG_NUMBER) {
        const bool off = key->none != NULL;
        char range[QUANTITY_RANGE_BYTES];
        quantity_print_range(key->quantity, min_number(key), key->max, range);
        length += (size_t)snprintf(text + length, bytes - length, " (%s%s%s)", off ? key->none : "",
                                   off ? ", or " : "", range);
    } else if (key->kind == CONFIG_CHOICE || key->kind == CONFIG_LENSES) {
        length += (size_t)snprintf(text + length, bytes - length, " (%s)", key->choices);
    }
    INVARIANT(length < bytes);
}

void config_key_explain(FILE *file, const struct config *config, const struct config_key *key,
                        bool in_profile, const char *line_begins) {
    size_t count = 0;
    char value[CONFIG_TEXT_BYTES + 16];
    char help[CONFIG_HELP_BYTES];
    config_key_describe(key, help, sizeof help);
    config_key_print(config, (size_t)(key - config_keys(&count)), value, sizeof value);
    fputc('\n', file);
    config_comment_print(file, help);
    fprintf(file, "%s%s = %s\n", line_begins, config_key_called(key, in_profile), value);
}

const char config_summary[] =
    "Settings of vergenced, with their defaults. A line is `key = value`; # starts a comment. "
    "Numbers have the unit that is shown; times may be in us, ms or s, frequencies in Hz, kHz or "
    "MHz. Check a file with: vergenced --check FILE";

const char config_rig_summary[] =
    "The profile sets the keys below; the values are those of the profile rig. Remove the # of a "
    "line to override the profile.";

void config_help_print(FILE *file) {
    struct config defaults;
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    bool of_rig = false;
    config_defaults(&defaults);
    fputs("# SPDX-License-Identifier: Apache-2.0\n", file);
    config_comment_print(file, config_summary);
    for (size_t i = 0; i < count; i++) {
        if (config_key_is_of_rig(i) && !of_rig) {
            fputc('\n', file);
            config_comment_print(file, config_rig_summary);
            of_rig = true;
        }
        config_key_explain(file, &defaults, &keys[i], false, of_rig ? "#" : "");
    }
}

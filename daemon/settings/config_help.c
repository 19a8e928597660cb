// SPDX-License-Identifier: Apache-2.0
// The pages of `--help-config`, `--help-profile` and `--help-lenses`.
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/settings/config.h"
#include "daemon/settings/config_keys.h"

/// Prints a comment, wrapped.
static void print_comment(FILE *file, const char *text) {
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
        quantity_print_range(key->quantity, config_key_min(key), key->max, range);
        length += (size_t)snprintf(text + length, bytes - length, " (%s%s%s)", off ? key->none : "",
                                   off ? ", or " : "", range);
    } else if (key->kind == CONFIG_CHOICE) {
        length += (size_t)snprintf(text + length, bytes - length, " (%s)", key->choices);
    }
    INVARIANT(length < bytes);
}

/// Prints a key with its value, and its help as a comment; `line_begins` goes before the key.
static void explain(FILE *file, const struct config *config, const struct config_key *key,
                    bool in_profile, const char *line_begins) {
    size_t count = 0;
    char value[CONFIG_TEXT_BYTES + 16];
    char help[CONFIG_HELP_BYTES];
    config_key_describe(key, help, sizeof help);
    config_key_print(config, (size_t)(key - config_keys(&count)), value, sizeof value);
    fputc('\n', file);
    print_comment(file, help);
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
    print_comment(file, config_summary);
    for (size_t i = 0; i < count; i++) {
        if (config_key_is_of_rig(i) && !of_rig) {
            fputc('\n', file);
            print_comment(file, config_rig_summary);
            of_rig = true;
        }
        explain(file, &defaults, &keys[i], false, of_rig ? "#" : "");
    }
}

int config_profile_print(FILE *file, const char *name, struct message *message) {
    struct config config;
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    config_defaults(&config);
    INVARIANT(keys[0].kind == CONFIG_PROFILE);
    const int error = config_key_set(&config, &keys[0], "--help-profile", name, false, message);
    if (error != ERROR_OK) {
        return error;
    }
    fputs("# SPDX-License-Identifier: Apache-2.0\n", file);
    print_comment(
        file,
        "A profile of vergenced: the cameras, FPGA, servos and lenses of an instrument. For "
        "an instrument of your own, copy this file, change what differs, delete the other "
        "lines, give it another name, and set profile = FILE in the settings. Check it "
        "with: vergenced --check FILE");
    fputc('\n', file);
    print_comment(file,
                  "the built-in profile that it starts from (rig two-cameras two-cameras-lens)");
    fprintf(file, CONFIG_LIKE " = %s\n", name);
    for (size_t i = 0; i < count; i++) {
        if (config_key_is_of_rig(i)) {
            explain(file, &config, &keys[i], true, "");
        }
    }
    return ERROR_OK;
}

void config_lenses_print(FILE *file) {
    size_t count = 0;
    const struct lens_driver *drivers = lens_drivers(&count);
    fputs(RIG_LENSES_FIXED ": no motors\n", file);
    for (size_t i = 0; i < count; i++) {
        const struct lens_settings *settings = &drivers[i].settings;
        fprintf(file, "%s: %s (", drivers[i].name, drivers[i].help);
        if (drivers[i].port == LENS_PORT_UART) {
            fprintf(file, "serial port, %u baud", (unsigned)settings->bits_per_s);
        } else {
            fprintf(file, "I2C, address 0x%02x", settings->address);
        }
        for (unsigned axis = 0; axis < LENS_AXES; axis++) {
            if ((drivers[i].abilities.axes >> axis & 1) != 0) {
                fprintf(file, "; %s %d to %d counts", lens_axis_names[axis],
                        (int)settings->axis[axis].min, (int)settings->axis[axis].max);
            }
        }
        fputs(")\n", file);
    }
}

// SPDX-License-Identifier: Apache-2.0
/// The one table of settings, for configuration and profiles alike, and what its readers share.
/// Others use config.h.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_KEYS_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_KEYS_H

#include <stddef.h>
#include <stdint.h>

#include "core/suggest.h"
#include "daemon/settings/config_types.h"
#include "daemon/settings/quantity.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CONFIG_KEYS_MAX = 128,                        ///< more than the number of keys
    CONFIG_CALLED_BYTES = 64,                     ///< size of a buffer for a name, also an old one
    CONFIG_VALUE_BYTES = CONFIG_TEXT_BYTES + 16,  ///< size of a buffer for a printed value
    CONFIG_LINE_BYTES = 512,  ///< size of a buffer for an argument; lines of files are shorter
    CONFIG_HELP_BYTES = 1024
};

/// Prefix of the keys that a profile sets. A profile file has them without it.
#define CONFIG_RIG "rig."
/// The name of the key `profile` in a profile file.
#define CONFIG_LIKE "like"

enum config_kind {
    CONFIG_PROFILE,  ///< a name of rig_profile_named, or a file; sets all keys of CONFIG_RIG
    CONFIG_NAME,     ///< an instrument's name: up to `bytes` - 1 letters, digits, - _ and .
    CONFIG_BACKEND,  ///< "linux", "sim ADDRESS", "replay DIRECTORY"
    CONFIG_TEXT,     ///< a text, up to `bytes` - 1 characters (< CONFIG_TEXT_BYTES); "none" is ""
    CONFIG_LENSES,   ///< the name of a lens driver, or RIG_LENSES_FIXED
    CONFIG_CHOICE,   ///< a word of `choices`; stores its index, plus `min`
    CONFIG_NUMBER,   ///< a `quantity`; an integer of `bytes` bytes, signed when `min` < 0
};

struct config_key {
    const char *name;
    enum config_kind kind;
    size_t offset;  ///< offset of the value in struct config
    size_t bytes;
    size_t repeat;     ///< distance to the same field of the next lens axis; 0: it is one field
    int64_t min, max;  ///< range of the integer
    enum quantity quantity;
    bool was_bare;  ///< older versions wrote the integer, in decimal and without a unit
    const char *choices;
    const char *none;  ///< the word for `min`, such as "off"; NULL if there is no such word
    const char *help;
};

/// All keys, in the order of the documentation; `*count` of them. A key that sets others precedes
/// them: values are set in this order.
const struct config_key *config_keys(size_t *count);

/// The name of a key in a profile file or in settings. Static storage.
const char *config_key_called(const struct config_key *key, bool in_profile);

/// The key of this name; `*old`: under a name of an older version. A profile's keys have their full
/// names, too. NULL if not found: then `suggest` has a similar name.
const struct config_key *config_key_find(const char *called, bool in_profile, bool *old,
                                         struct suggest *suggest);

/// Whether a value is in the notation of older versions: it has an old name, or no unit.
bool config_key_is_old(const struct config_key *key, bool old_name, const char *value);

/// As config_set, with the name of the key in messages. `old` is what config_key_is_old says.
int config_key_set(struct config *config, const struct config_key *key, const char *called,
                   const char *value, bool old, struct message *message);

/// The smallest number of a key: `min` itself has a word where there is one.
int64_t config_key_min(const struct config_key *key);

/// The help of a key, with its range or choices. `text` has CONFIG_HELP_BYTES.
void config_key_describe(const struct config_key *key, char *text, size_t bytes);

/// Introductions: to all settings, and to those of the instrument.
extern const char config_summary[], config_rig_summary[];

/// A line or an argument that sets a key.
struct config_line {
    const char *file;  ///< its name in messages; NULL: an argument
    int number;        ///< line number, from 1; 0: nothing sets the key
    bool old;          ///< the line is in the notation of older versions
    char called[CONFIG_CALLED_BYTES];
    char value[CONFIG_LINE_BYTES];
};

/// Puts FILE:LINE of a line in front of the message, nothing of an argument. Returns `error`.
int config_line_error(const struct config_line *line, int error, struct message *message);

/// Whether the settings are consistent: the profile, and the devices that it needs, or a profile
/// alone. `lines` holds, for each key, what set it; NULL: not known. 0, or an error with a message
/// that begins with the line of the first key that it names and that a line set.
int config_check_lines(const struct config *config, const struct config_line *lines,
                       bool profile_only, struct message *message);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// The one table of settings.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_KEYS_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_KEYS_H

#include <stddef.h>
#include <stdint.h>

#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CONFIG_KEYS_MAX = 128,  ///< more than there are
    CONFIG_HELP_BYTES = 1024
};

/// How the keys begin that a profile sets. A profile's file has them without it.
#define CONFIG_RIG "rig."
/// The key `profile`, as a profile's file has it.
#define CONFIG_LIKE "like"

enum config_kind {
    CONFIG_PROFILE,  ///< a name of rig_profile_named, or a file; sets all keys of CONFIG_RIG
    CONFIG_NAME,     ///< of an instrument: up to `bytes` - 1 letters, digits, - _ and .
    CONFIG_BACKEND,  ///< "linux", "sim ADDRESS", "replay DIRECTORY"
    CONFIG_TEXT,     ///< `bytes` of it, CONFIG_TEXT_BYTES at most; "none" is ""
    CONFIG_LENSES,   ///< a word of `choices`, in the order of enum rig_profile_lenses
    CONFIG_CHOICE,   ///< a word of `choices`; its place into an int, or as `bytes` says
    CONFIG_NUMBER,   ///< a whole number of `bytes` bytes; signed when `least` < 0
};

struct config_key {
    const char *name;
    enum config_kind kind;
    size_t offset;  ///< in struct config
    size_t bytes;
    double least, most;
    const char *unit;
    const char *choices;
    const char *none;  ///< the word for `least`, such as "off"; NULL: none
    const char *sets;  ///< keys that begin so get new values with this one; NULL: none
    const char *help;
};

/// All keys, in the order in which people read them; `*count` of them.
const struct config_key *config_keys(size_t *count);

/// A key as a line calls it: of a profile's file or of settings. Static storage.
const char *config_key_called(const struct config_key *key, bool in_profile);

/// The key that a line calls so; NULL, and in `*nearest` what may be meant, or NULL.
const struct config_key *config_key_find(const char *called, bool in_profile, const char **nearest);

/// As config_set, with a name for the key in messages.
int config_key_set(struct config *config, const struct config_key *key, const char *called,
                   const char *value, struct message *message);

/// What a key means, and its limits or its choices. `text` has CONFIG_HELP_BYTES.
void config_key_describe(const struct config_key *key, char *text, size_t bytes);

/// What stands at the head of all settings, and before those of the instrument.
extern const char config_summary[], config_rig_summary[];

/// A key with its help, as a comment, and what it is set to; `in_profile` as above, `line_begins`
/// before the key.
void config_key_explain(FILE *file, const struct config *config, const struct config_key *key,
                        bool in_profile, const char *line_begins);

/// A comment, wrapped.
void config_comment_print(FILE *file, const char *text);

#ifdef __cplusplus
}
#endif

#endif

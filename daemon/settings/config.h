// SPDX-License-Identifier: Apache-2.0
/// The daemon's settings: an INI file of lines `key = value`, where `#` starts a comment. The key
/// `rig.width` may also stand as `width` in a section `[rig]`. One table holds all keys with their
/// types, ranges, units and help; the reader, `--help-config` and the example file derive from it.
/// A profile is such a file, whose name ends in .profile, with the keys of the instrument only.
/// Keys and values in the notation of older versions are read as well.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_H

#include <stdio.h>

#include "daemon/settings/config_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Sets every key to its default.
void config_defaults(struct config *config);

/// Sets all keys: from the defaults, a file (NULL: none) and `count` arguments KEY=VALUE of a
/// command line. An argument replaces the file's line of the same key. The order of lines does not
/// matter: a profile is set before what changes it. A `path` that ends in .profile is a profile, of
/// otherwise default settings. Lines in the notation of older versions are added to `old`. 0;
/// ERROR_IO, ERROR_SYNTAX, ERROR_RANGE, ERROR_MISSING, ERROR_DUPLICATE, ERROR_ARGUMENT or
/// ERROR_MEMORY with a message, which starts with FILE:LINE where a line is wrong.
int config_load(struct config *config, const char *path, const char *const *words, int count,
                struct config_old_lines *old, struct message *message);

/// The same for the `length` bytes of the text of a file `name`; opens no file: `profile` must be a
/// built-in one.
int config_parse(struct config *config, const char *name, const char *text, size_t length,
                 struct message *message);

/// Sets one key as a line `key = value` of a file does, but opens no file: `profile` must be a
/// built-in one. 0, or an error with a message without the line.
int config_set(struct config *config, const char *key, const char *value, struct message *message);

/// Parses the setting `tcp_network`: an IPv4 network of 8 to 32 bits, without bits behind them.
/// Both in the host's byte order. False: something else.
bool config_parse_network(const char *text, uint32_t *address, uint32_t *mask);

/// Number of keys; name of a key; whether a profile sets it; its value as a file has it, in `text`
/// (CONFIG_TEXT_BYTES + 16 bytes).
size_t config_key_count(void);

const char *config_key_name(size_t index);

bool config_key_is_of_rig(size_t index);

void config_key_print(const struct config *config, size_t index, char *text, size_t bytes);

/// Prints the page of `--help-config`, which is a file of all defaults with comments.
void config_help_print(FILE *file);

/// Prints a built-in profile as a file, with comments. ERROR_ARGUMENT with a message for an unknown
/// name.
int config_profile_print(FILE *file, const char *name, struct message *message);

/// Prints the values of the key `lenses`: each lens controller with its port and its ranges.
void config_lenses_print(FILE *file);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// Lines `key = value` of settings or of a profile, and arguments of a command line, which follow
/// the same rules. Only for the readers of settings; others use config.h.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_LINES_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_LINES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "daemon/settings/config_keys.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Reads a profile where the value of the key `profile` is a file.
struct config_lines_profiles {
    bool (*is_file)(const char *value);
    /// Reads the file `name`, relative to the file `relative_to`. 0, or an error with a message.
    int (*load)(struct config *config, const char *relative_to, const char *name,
                struct config_old_lines *old, struct message *message);
};

/// A reader, and what it has read so far.
struct config_lines {
    struct config *config;
    const char *file;  ///< its name in messages; NULL: a command line
    bool in_profile;   ///< a profile: `like`, and the keys of CONFIG_RIG without that prefix
    const struct config_lines_profiles *profiles;  ///< NULL: only built-in ones are known
    struct config_old_lines *old;                  ///< NULL: not counted
    int places[CONFIG_KEYS_MAX];  ///< line or argument that set each key, from 1; 0: none did
};

/// Reads `length` bytes of text. 0, or an error with a message that starts with FILE:LINE.
int config_lines_set(struct config_lines *self, const char *text, size_t length,
                     struct message *message);

/// Likewise, reads all of an open file.
int config_lines_read(struct config_lines *self, FILE *file, struct message *message);

/// Reads `count` arguments of a command line. 0, or an error with a message.
int config_lines_arguments(struct config_lines *self, const char *const *words, int count,
                           struct message *message);

/// Puts FILE:LINE in front of the message and returns `error`.
int config_lines_at(const char *file, int line, int error, struct message *message);

#ifdef __cplusplus
}
#endif

#endif

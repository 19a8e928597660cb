// SPDX-License-Identifier: Apache-2.0
/// Lines `key = value` of settings or of a profile's file, and words of a command line, which
/// follow the same rules. For the readers of settings alone; others ask config.h.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_LINES_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_LINES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "daemon/settings/config_keys.h"

#ifdef __cplusplus
extern "C" {
#endif

/// How the value of `profile` may be a file of its own, which is read, too.
struct config_lines_profiles {
    bool (*is_file)(const char *value);
    /// Sets what the file `name`, as seen from `beside`, says. 0, or an error with a message.
    int (*load)(struct config *config, const char *beside, const char *name,
                struct message *message);
};

/// What is read, and how far that is.
struct config_lines {
    struct config *config;
    const char *file;  ///< its name in messages; NULL: a command line
    bool in_profile;   ///< a profile's file: `like`, and the keys of CONFIG_RIG without that
    const struct config_lines_profiles *profiles;  ///< NULL: only built-in ones are known
    int places[CONFIG_KEYS_MAX];  ///< for each key the line or word that set it, from 1; 0: none
};

/// Sets what `length` bytes of text say. 0, or an error with a message that begins with FILE:LINE.
int config_lines_set(struct config_lines *self, const char *text, size_t length,
                     struct message *message);

/// Likewise all that an open file has.
int config_lines_read(struct config_lines *self, FILE *file, struct message *message);

/// Sets what words of a command line say. 0, or an error with a message.
int config_lines_words(struct config_lines *self, const char *const *words, int count,
                       struct message *message);

/// Puts FILE:LINE in front of the message and returns `error`.
int config_lines_at(const char *file, int line, int error, struct message *message);

#ifdef __cplusplus
}
#endif

#endif

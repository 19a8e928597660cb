// SPDX-License-Identifier: Apache-2.0
/// A profile as a file: lines `key = value`, first `like` with the built-in profile that it starts
/// from, then the rig. keys of the settings, without that prefix.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_PROFILE_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_PROFILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether a name ends in .profile.
bool config_profile_has_ending(const char *name);

/// Whether the value of `profile` is a file: it contains a /, or ends in .profile.
bool config_profile_is_file(const char *value);

/// Sets the profile from `length` bytes of a file's text, and `profile_file` to `name`. 0, or an
/// error with a message that starts with `name`, and with the line where one is wrong; the profile
/// is undefined then.
int config_profile_parse(struct config *config, const char *name, const char *text, size_t length,
                         struct message *message);

/// Likewise from the file `name`, which is relative to the directory of the file `relative_to`
/// (NULL: to the working directory). Lines in the notation of older versions are added to `old`,
/// which may be NULL.
int config_profile_load(struct config *config, const char *relative_to, const char *name,
                        struct config_old_lines *old, struct message *message);

/// Prints a built-in profile as such a file, with comments. ERROR_ARGUMENT with a message for an
/// unknown name.
int config_profile_print(FILE *file, const char *name, struct message *message);

#ifdef __cplusplus
}
#endif

#endif

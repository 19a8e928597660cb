// SPDX-License-Identifier: Apache-2.0
/// A profile as a file: lines `key = value`, first `like` with the built-in one that it begins
/// with, then the keys that settings have as rig.KEY, without rig.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_PROFILE_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_PROFILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether a name ends as those of such files do: in .profile.
bool config_profile_has_ending(const char *name);

/// Whether the value of `profile` names a file: it has a /, or that ending.
bool config_profile_is_file(const char *value);

/// Sets the profile, and `profile_file` to `name`, by `length` bytes of a file's text. 0, or an
/// error with a message that begins with `name`, and with the line where one is wrong; what there
/// was of the profile is undefined then.
int config_profile_parse(struct config *config, const char *name, const char *text, size_t length,
                         struct message *message);

/// Likewise from the file `name`. One that does not begin with / is seen from the folder of
/// `beside`, a file (NULL: from the working directory).
int config_profile_load(struct config *config, const char *beside, const char *name,
                        struct message *message);

/// Prints a built-in profile as such a file, each line explained. ERROR_ARGUMENT, with a message,
/// when there is none of this name.
int config_profile_print(FILE *file, const char *name, struct message *message);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// Consistency of settings, with the line that breaks it. Only for the readers of settings; others
/// use config_check.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_CHECK_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_CHECK_H

#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

/// As config_check. `lines` holds, for each key of config_keys, the line that set it, 0 if none
/// did. Of keys that conflict, the message starts with one that a line set, and `*line` is that
/// line; it is not changed if no line set any of them.
int config_check_lines(const struct config *config, const int *lines, int *line,
                       struct message *message);

/// Likewise for a profile alone, with the names of its keys in the message; `*line` is never 0
/// after an error.
int config_check_profile(const struct config *config, const int *lines, int *line,
                         struct message *message);

#ifdef __cplusplus
}
#endif

#endif

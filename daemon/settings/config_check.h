// SPDX-License-Identifier: Apache-2.0
/// Whether settings make sense together, with the line of the one that does not. For the readers of
/// settings alone; others ask config_check.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_CHECK_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_CHECK_H

#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

/// As config_check. `lines` says for each key of config_keys which line set it, 0: none did. Of
/// keys that do not go together the message begins with one that a line set, and `*line` is that
/// line; untouched when there is none.
int config_check_lines(const struct config *config, const int *lines, int *line,
                       struct message *message);

/// Likewise of a profile's file alone, whose keys the message calls as that does; `*line` is never
/// 0 after an error.
int config_check_profile(const struct config *config, const int *lines, int *line,
                         struct message *message);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// What `vergence help` prints, for people, for man(1) and for a shell.
#ifndef VERGENCE_DAEMON_CLIENT_CLIENT_HELP_H
#define VERGENCE_DAEMON_CLIENT_CLIENT_HELP_H

#include <stdio.h>

#include "daemon/client/client.h"

#ifdef __cplusplus
extern "C" {
#endif

/// How `vergence help` calls the page of --connect, which is no command.
#define CLIENT_HELP_CONNECT "connect"

/// Prints the page.
void client_help_print(FILE *file, const struct client_command *commands, int command_count);

/// The same for man(1).
void client_help_print_manual(FILE *file, const struct client_command *commands, int command_count);

/// Names of all that has a page of its own, a line each.
void client_help_print_names(FILE *file, const struct client_command *commands, int command_count);

/// What a shell may fill in behind `vergence` and `vergence help` (shell_words.h).
void client_help_print_words(FILE *file, const struct client_command *commands, int command_count);

#ifdef __cplusplus
}
#endif

#endif

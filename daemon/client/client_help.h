// SPDX-License-Identifier: Apache-2.0
/// The pages of `vergence help`: for people, for man(1) and for shell completion.
#ifndef VERGENCE_DAEMON_CLIENT_CLIENT_HELP_H
#define VERGENCE_DAEMON_CLIENT_CLIENT_HELP_H

#include <stdio.h>

#include "daemon/client/client.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Name under which `vergence help` lists the page of --connect, which is not a command.
#define CLIENT_HELP_CONNECT "connect"

/// Prints the page for people.
void client_help_print(FILE *file, const struct client_command *commands, int command_count);

/// Prints the page for man(1).
void client_help_print_manual(FILE *file, const struct client_command *commands, int command_count);

/// Prints the names of everything that has its own page, one per line.
void client_help_print_names(FILE *file, const struct client_command *commands, int command_count);

/// Prints completions for `vergence` and `vergence help` (shell_completion.h).
void client_help_print_completion(FILE *file, const struct client_command *commands,
                                  int command_count);

#ifdef __cplusplus
}
#endif

#endif

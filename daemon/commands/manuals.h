// SPDX-License-Identifier: Apache-2.0
/// Manual pages and shell completion of the daemon's settings and commands, from the tables that
/// `--help-config` and `help` print.
#ifndef VERGENCE_DAEMON_COMMANDS_MANUALS_H
#define VERGENCE_DAEMON_COMMANDS_MANUALS_H

#include <stddef.h>
#include <stdio.h>

#include "console/command.h"

/// vergenced.conf(5).
void manuals_print_config(FILE *file);

/// vergence-console(7), of `count` commands.
void manuals_print_console(FILE *file, const struct command *table, size_t count);

/// Words for the shell: settings after `vergenced`, commands after `vergence --connect WHERE`
/// (help.h).
void manuals_print_completion(FILE *file, const struct command *table, size_t count);

#endif

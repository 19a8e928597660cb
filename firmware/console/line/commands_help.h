// SPDX-License-Identifier: Apache-2.0
/// The commands about commands: `help` and `complete`.
#ifndef VERGENCE_CONSOLE_LINE_COMMANDS_HELP_H
#define VERGENCE_CONSOLE_LINE_COMMANDS_HELP_H

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

const struct command *command_help_table(size_t *count);
/// Adds the names of all commands.
void commands_help_candidates(const struct command_candidates *to);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// The commands of the board's console: those of the rig, `help`, and `board`.
#ifndef VERGENCE_BF537_COMMANDS_H
#define VERGENCE_BF537_COMMANDS_H

#include "console/command.h"

/// All commands. Static storage.
struct command_table bf537_commands(void);

#endif

// SPDX-License-Identifier: Apache-2.0
/// What an instrument without a disk does for commands that consist of others.
#ifndef VERGENCE_MEMORY_HOST_H
#define VERGENCE_MEMORY_HOST_H

#include "console/command.h"
#include "console/pair/zoom_query.h"

extern const struct command_host memory_host;

/// Runs a command of the console's table. Its error, with the call's message.
int memory_host_give(const struct command_call *call, const char *line,
                     const struct command_reply *reply);

/// Whether a long command must end. Looks after the rig, too, which is lost to the bridge's
/// watchdog otherwise.
bool memory_host_should_stop(const struct command_call *call);

/// The rig's commands, with a `zoom` that uses the calibration in force.
const struct command *memory_rig_table(size_t *count);

#endif

// SPDX-License-Identifier: Apache-2.0
/// What an instrument without a disk does for commands that consist of others.
#ifndef VERGENCE_MEMORY_HOST_H
#define VERGENCE_MEMORY_HOST_H

#include "console/command.h"
#include "console/pair/zoom_query.h"

extern const struct command_host memory_host;

/// The rig's commands, with a `zoom` that uses the calibration in force.
const struct command *memory_rig_table(size_t *count);

#endif

// SPDX-License-Identifier: Apache-2.0
/// The console's command `replay`. Separate from the other commands because it requires a backend.
#ifndef VERGENCE_DAEMON_MAIN_REPLAY_H
#define VERGENCE_DAEMON_MAIN_REPLAY_H

#include <stddef.h>

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

const struct command *main_replay_table(size_t *count);

#ifdef __cplusplus
}
#endif

#endif

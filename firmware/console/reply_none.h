// SPDX-License-Identifier: Apache-2.0
/// A reply that discards everything, for commands run within another command or in a replay.
#ifndef VERGENCE_CONSOLE_REPLY_NONE_H
#define VERGENCE_CONSOLE_REPLY_NONE_H

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The discarding reply. Static storage.
const struct command_reply *reply_none(void);

#ifdef __cplusplus
}
#endif

#endif

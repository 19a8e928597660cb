// SPDX-License-Identifier: Apache-2.0
/// An answer that nobody reads, of commands that are given within another one or played again.
#ifndef VERGENCE_CONSOLE_REPLY_NONE_H
#define VERGENCE_CONSOLE_REPLY_NONE_H

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Static storage.
const struct command_reply *reply_none(void);

#ifdef __cplusplus
}
#endif

#endif

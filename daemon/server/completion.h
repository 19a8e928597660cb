// SPDX-License-Identifier: Apache-2.0
/// What Tab may fill in: names of commands, choices of arguments.
#ifndef VERGENCE_DAEMON_SERVER_COMPLETION_H
#define VERGENCE_DAEMON_SERVER_COMPLETION_H

#include <stddef.h>

#include "rig/command.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The words that may follow `before` (whole words), with blanks between, in `words`.
void completion_words(const struct command *table, size_t count, const char *before, char *words,
                      size_t bytes);

#ifdef __cplusplus
}
#endif

#endif

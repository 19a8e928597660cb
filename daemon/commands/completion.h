// SPDX-License-Identifier: Apache-2.0
/// What Tab may fill in: names of commands, choices of arguments, and what arguments name, as far
/// as the table of commands knows.
#ifndef VERGENCE_DAEMON_COMMANDS_COMPLETION_H
#define VERGENCE_DAEMON_COMMANDS_COMPLETION_H

#include <stddef.h>

#include "daemon/commands/surroundings.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The words that may stand where `typed`, a line up to the cursor, ends: with blanks between, in
/// `words`, as many as fit. Some may begin otherwise than the word that was begun. Words that would
/// have to be quoted are left out. Of the surroundings the table, the settings and the files are
/// used.
void completion_words(const struct surroundings *around, const char *typed, char *words,
                      size_t bytes);

#ifdef __cplusplus
}
#endif

#endif

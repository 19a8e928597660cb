// SPDX-License-Identifier: Apache-2.0
/// Completion of a command line.
#ifndef VERGENCE_CONSOLE_LINE_COMPLETION_H
#define VERGENCE_CONSOLE_LINE_COMPLETION_H

#include <stddef.h>

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Writes the possible completions of `typed`, a line up to the cursor, to `words`: separated by
/// blanks, as many as fit. They all begin with the last word of `typed`. Words that would need
/// quotes are omitted. `context`: for the arguments of the table's commands.
void completion_words(const struct command_table *table, const void *context, const char *typed,
                      char *words, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif

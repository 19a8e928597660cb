// SPDX-License-Identifier: Apache-2.0
/// Tab completion: names of commands, choices of arguments, and other values (files, settings) for
/// which the table of commands has a source.
#ifndef VERGENCE_DAEMON_SERVER_COMPLETION_H
#define VERGENCE_DAEMON_SERVER_COMPLETION_H

#include <stddef.h>

#include "daemon/server/daemon.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Writes the possible completions of `typed`, a line up to the cursor, to `words`: separated by
/// blanks, as many as fit. They all begin with the last word of `typed`. Words that would need
/// quotes are omitted. Uses the table, the configuration and the files of `daemon`.
void completion_candidates(const struct daemon *daemon, const char *typed, char *words,
                           size_t bytes);

#ifdef __cplusplus
}
#endif

#endif

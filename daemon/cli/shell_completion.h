// SPDX-License-Identifier: Apache-2.0
/// Shell completion from the tables behind --help: bash statements that fill the array
/// _vergence_words of tools/install/completion.bash.in. A key is a command, "vergence info", with
/// the words that may follow it; or a command and one of its options or words, "vergence info
/// --size", with its values, "" if these are files, numbers or free text.
#ifndef VERGENCE_DAEMON_CLI_SHELL_COMPLETION_H
#define VERGENCE_DAEMON_CLI_SHELL_COMPLETION_H

#include <stdio.h>

#include "daemon/cli/options.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Sets the words of a key, separated by blanks. The key is `key` alone if `part` is NULL.
void shell_completion_print(FILE *file, const char *key, const char *part, const char *words);

/// Adds a word to a key.
void shell_completion_add(FILE *file, const char *key, const char *word);

/// Adds the options of a page and their values.
void shell_completion_options(FILE *file, const struct option_page *page);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// What a shell's Tab may fill in, from the tables behind --help: statements of bash that fill the
/// array _vergence_words of tools/install/completion.bash.in. Its keys are a command, "vergence
/// info", for the words behind it; and an option or another word of it, "vergence info --size", for
/// its values, which are "" where they are files, numbers or anything else.
#ifndef VERGENCE_DAEMON_CLI_SHELL_WORDS_H
#define VERGENCE_DAEMON_CLI_SHELL_WORDS_H

#include <stdio.h>

#include "daemon/cli/options.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The words, with blanks between, of a key; of `key` alone where `part` is NULL.
void shell_words_print(FILE *file, const char *key, const char *part, const char *words);

/// One more word of a key.
void shell_words_add(FILE *file, const char *key, const char *word);

/// The options of a page, and their values.
void shell_words_options(FILE *file, const struct option_page *page);

#ifdef __cplusplus
}
#endif

#endif

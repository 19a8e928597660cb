// SPDX-License-Identifier: Apache-2.0
/// What other programs call a command or an option, and its name here: for "did you mean".
#ifndef VERGENCE_CONSOLE_SYNONYMS_H
#define VERGENCE_CONSOLE_SYNONYMS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

struct synonym {
    const char *typed;  ///< one word, or of a line the command and its first word
    const char *meant;  ///< a command's name, or options separated by blanks
};

const struct synonym *synonyms_of_commands(size_t *count);
const struct synonym *synonyms_of_options(size_t *count);

/// What is meant by a word, or by a command with its first word (NULL: none); NULL: not known.
const char *synonyms_command(const char *typed, const char *first);
const char *synonyms_options(const char *typed);

#ifdef __cplusplus
}
#endif

#endif

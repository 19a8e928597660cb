// SPDX-License-Identifier: Apache-2.0
/// A line as words, and what a word means: the part of command_parse that knows no commands.
#ifndef VERGENCE_CONSOLE_COMMAND_WORDS_H
#define VERGENCE_CONSOLE_COMMAND_WORDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { COMMAND_WORDS_MAX = 10, COMMAND_CHOICE_MAX = 32 };

/// Splits a line. `words` (COMMAND_WORDS_MAX) point into `storage` (COMMAND_LINE_MAX + 1 bytes).
/// Words beyond the most are not stored but counted as one. ERROR_SYNTAX with `*why` (static
/// storage) for a line that is too long, holds a control character or a quote without its end.
int command_words_split(const char *line, char *storage, const char **words, size_t *count,
                        const char **why);

/// A decimal number of at most 15 digits, with a point or without; false: something else.
bool command_words_number(const char *word, double *value);

/// A decimal or hexadecimal (0x...) number; false: something else. Beyond int64_t it is the
/// nearest one of that.
bool command_words_integer(const char *word, int64_t *value);

/// The place of a word in a list of words with a blank between; -1: none of them.
int command_words_choice(const char *word, const char *choices);

/// Copies the `index`-th word of such a list into `word` (COMMAND_CHOICE_MAX bytes); false: there
/// are not as many. Each is shorter than that.
bool command_words_choice_at(const char *choices, int index, char *word);

/// More mistakes than that are no slip of the finger.
enum { COMMAND_SLIPS_MAX = 3 };

/// How many letters must change, come or go to make one word of the other; words longer than
/// COMMAND_CHOICE_MAX are far from everything, and so are words whose lengths differ by more than
/// COMMAND_SLIPS_MAX. A word of three letters or more that begins the other is 1 away.
int command_words_distance(const char *word, const char *other);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// Splits a line into words and converts words to values: the part of command_parse that does not
/// depend on commands.
#ifndef VERGENCE_CONSOLE_COMMAND_WORDS_H
#define VERGENCE_CONSOLE_COMMAND_WORDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Longest line, without its end.
enum { COMMAND_LINE_MAX = 512 };

enum { COMMAND_WORDS_MAX = 24, COMMAND_CHOICE_MAX = 32 };

/// The words of a line.
struct command_words {
    const char *word[COMMAND_WORDS_MAX];
    size_t count;
    uint32_t quoted;  ///< bit i: word[i] was in quotes
};

/// Splits a line. The words are in `storage` (COMMAND_LINE_MAX + 1 bytes). Returns ERROR_SYNTAX
/// with `*why` (static storage) if the line is too long, has too many words, contains a control
/// character or has an unterminated quote.
int command_words_split(const char *line, char *storage, struct command_words *words,
                        const char **why);

/// Parses a decimal number of at most 15 digits, with or without a point; false: not a number.
bool command_words_number(const char *word, double *value);

/// Parses a decimal or hexadecimal (0x...) integer; false: not an integer. Saturates at the limits
/// of int64_t.
bool command_words_integer(const char *word, int64_t *value);

/// Splits "5x", "40mm" or "f/8" into a number, copied to `number` (`bytes`), and one of the units
/// in a list separated by blanks; of these, one that ends in / precedes its number. Returns the
/// unit's index, -1: none of these. Whether the rest is a number is not checked.
int command_words_unit(const char *word, const char *units, char *number, size_t bytes);

/// Index of a word in a list separated by blanks; -1: not in the list.
int command_words_choice(const char *word, const char *choices);

/// Copies the `index`-th word of such a list into `word` (COMMAND_CHOICE_MAX bytes); false: the
/// list is shorter. Each word is shorter than that.
bool command_words_choice_at(const char *choices, int index, char *word);

#ifdef __cplusplus
}
#endif

#endif

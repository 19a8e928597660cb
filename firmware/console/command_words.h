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

/// Parses a decimal number, with or without a point, of which 15 digits count; false: not a number.
bool command_words_number(const char *word, double *value);

/// Parses a decimal or hexadecimal (0x...) integer; false: not an integer. Saturates at the limits
/// of int64_t.
bool command_words_integer(const char *word, int64_t *value);

/// A number with a unit, as it was read.
struct command_number {
    double value;  ///< number in the unit `unit`
    int unit;      ///< index in the list of those accepted
    bool stated;   ///< the number was typed with its unit
    /// It was a fraction or in another unit: decimals may be those of the conversion.
    bool converted;
};

enum command_quantity {
    COMMAND_QUANTITY_READ,
    COMMAND_QUANTITY_NO_NUMBER,
    COMMAND_QUANTITY_UNKNOWN_UNIT,
};

/// Reads all of a text such as "1.8 m", "40mm", "10 ms", "1/100", "5x" or "f/8": a number, which is
/// in the first of the `accepted` units (separated by blanks; "" or NULL: none) unless another one
/// or one of the same kind follows. Lengths (um mm cm m km), times (us ms s min), frequencies (Hz
/// kHz MHz) and angles (mrad rad deg) stand for each other, and so do counts and steps. A time may
/// be a fraction, of a second if no unit follows.
enum command_quantity command_words_quantity(const char *text, const char *accepted,
                                             struct command_number *number);

/// Index of the accepted unit of which this one is a multiple, with `*ratio` of them; -1: none.
int command_words_unit(const char *unit, const char *accepted, double *ratio);

/// Index of a word in a list separated by blanks; -1: not in the list.
int command_words_choice(const char *word, const char *choices);

/// Copies the `index`-th word of such a list into `word` (COMMAND_CHOICE_MAX bytes); false: the
/// list is shorter. Each word is shorter than that.
bool command_words_choice_at(const char *choices, int index, char *word);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// Sentences made of pieces in a buffer of fixed size, without stdio. What does not fit is cut off;
/// the text is always terminated.
#ifndef VERGENCE_CONSOLE_COMMAND_TEXT_H
#define VERGENCE_CONSOLE_COMMAND_TEXT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct command_text {
    char *data;
    size_t bytes, length;
};

/// Begins an empty text in `bytes` (> 0) bytes at `data`.
struct command_text command_text_begin(char *data, size_t bytes);

/// Adds a string; as much of it as fits.
void command_text_add(struct command_text *text, const char *added);
/// Adds a string as it was typed: without control characters, and at most 40 bytes of it.
void command_text_add_typed(struct command_text *text, const char *added);
/// Adds a number with at most `decimals` (0 .. 6) decimals, without zeros at their end, and with
/// fewer when it is large. |value| <= 1e15; beyond that "?".
void command_text_add_number(struct command_text *text, double value, int decimals);
void command_text_add_integer(struct command_text *text, int64_t value);
/// Adds " UNIT" unless `unit` is NULL.
void command_text_add_unit(struct command_text *text, const char *unit);
/// Adds 0x and `digits` (1 .. 8) hexadecimal digits.
void command_text_add_hex(struct command_text *text, uint32_t value, int digits);

#ifdef __cplusplus
}
#endif

#endif

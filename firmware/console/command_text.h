// SPDX-License-Identifier: Apache-2.0
/// Builds text in a fixed buffer, without stdio. Text that does not fit is cut off; the result is
/// always terminated.
#ifndef VERGENCE_CONSOLE_COMMAND_TEXT_H
#define VERGENCE_CONSOLE_COMMAND_TEXT_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "core/message.h"

#ifdef __cplusplus
extern "C" {
#endif

struct command_text {
    char *data;
    size_t bytes, length;
};

/// Starts an empty text in `bytes` (> 0) bytes at `data`.
struct command_text command_text_begin(char *data, size_t bytes);

/// Appends as much of a string as fits.
void command_text_add(struct command_text *text, const char *added);
/// Appends the strings up to NULL.
__attribute__((sentinel)) void command_text_add_all(struct command_text *text, ...);
/// Appends all the strings given.
#define command_text_join(text, ...) command_text_add_all(text, __VA_ARGS__, (const char *)NULL)
/// Appends user input: at most 40 bytes, without control characters.
void command_text_add_typed(struct command_text *text, const char *added);
enum { COMMAND_TEXT_DECIMALS_MAX = 9 };
/// Appends a number with at most `decimals` (0 .. COMMAND_TEXT_DECIMALS_MAX) decimals, without
/// trailing zeros, and with fewer if it is large. |value| <= 1e15; beyond that "?".
void command_text_add_number(struct command_text *text, double value, int decimals);
/// Decimals with which a number of this size (its absolute value) has three digits.
int command_text_decimals(double size);
void command_text_add_integer(struct command_text *text, int64_t value);
/// Appends " UNIT" unless `unit` is NULL.
void command_text_add_unit(struct command_text *text, const char *unit);
/// Appends as printf does: %s, %d, %u, %x with leading zeros (%08x), %f with decimals (%.3f, %.*f),
/// %%; nothing else.
__attribute__((format(printf, 2, 3))) void command_text_print(struct command_text *text,
                                                              const char *format, ...);
/// The same with a list of arguments.
void command_text_print_list(struct command_text *text, const char *format, va_list values);
/// Sets a message so, with ? in place of control characters, and returns `code`.
__attribute__((format(printf, 3, 4))) int command_text_message(struct message *message, int code,
                                                               const char *format, ...);
/// Appends 0x and `digits` (1 .. 8) hexadecimal digits.
void command_text_add_hex(struct command_text *text, uint32_t value, int digits);

#ifdef __cplusplus
}
#endif

#endif

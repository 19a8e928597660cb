// SPDX-License-Identifier: Apache-2.0
/// Text from elsewhere (another program, a file, a name), for a terminal: no control character of
/// it may command that.
#ifndef VERGENCE_DAEMON_BASE_PRINTABLE_H
#define VERGENCE_DAEMON_BASE_PRINTABLE_H

#include <stddef.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Prints a text; each byte of a control character (also those of 8 bits, U+0080 to U+009F) and
/// each byte that is not UTF-8 as \xHH.
void printable_print(FILE *file, const char *text);

/// The same for a line of JSON, which stays one: control characters as \u00HH, of blanks between
/// its values only the space, other bytes as they are.
void printable_print_json(FILE *file, const char *text);

/// Copies as much of a text as fits into `bytes`, with ? for each of these bytes.
void printable_copy(const char *text, char *to, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif

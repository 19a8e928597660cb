// SPDX-License-Identifier: Apache-2.0
/// Prints text from elsewhere (another program, a file, a name) safely: control characters never
/// reach the terminal.
#ifndef VERGENCE_DAEMON_BASE_PRINTABLE_H
#define VERGENCE_DAEMON_BASE_PRINTABLE_H

#include <stddef.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Prints a text; each byte of a control character (including U+0080 to U+009F) and each byte that
/// is not UTF-8 is printed as \xHH.
void printable_print(FILE *file, const char *text);

/// Prints a line of JSON, which stays valid: control characters as \u00HH, white space between
/// values as spaces, other bytes unchanged.
void printable_print_json(FILE *file, const char *text);

/// Copies as much of a text as fits into `bytes`, with ? in place of each such byte.
void printable_copy(const char *text, char *to, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif

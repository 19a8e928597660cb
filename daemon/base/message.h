// SPDX-License-Identifier: Apache-2.0
/// One line for people: what is wrong and what to do about it. Written where the error is found,
/// next to the file name and the limit; the error code that goes with it is for programs. And text
/// from elsewhere (another program, a file, a name), printed safely: control characters, and those
/// that turn the direction of writing, never reach the terminal.
#ifndef VERGENCE_DAEMON_BASE_MESSAGE_H
#define VERGENCE_DAEMON_BASE_MESSAGE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "core/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Formats the text as printf does and returns `code`, so that a function can end with `return
/// message_set(message, ERROR_SYNTAX, ...)`. Control characters (a file name may contain any)
/// become '?', so that the message stays one line that is shown in its order.
int message_set(struct message *message, int code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// Prints a text; each byte of a control character (including U+0080 to U+009F) and each byte that
/// is not UTF-8 is printed as \xHH; control characters include those of the direction of writing.
void printable_print(FILE *file, const char *text);

/// Prints a line of JSON, which stays valid: control characters as \uHHHH, white space between
/// values as spaces, other bytes unchanged.
void printable_print_json(FILE *file, const char *text);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// One line for people: what is wrong and what to do about it. Written where the error is found,
/// next to the file name and the limit; the error code that goes with it is for programs.
#ifndef VERGENCE_DAEMON_BASE_MESSAGE_H
#define VERGENCE_DAEMON_BASE_MESSAGE_H

#ifdef __cplusplus
extern "C" {
#endif

enum { MESSAGE_BYTES = 1024 };

struct message {
    char text[MESSAGE_BYTES];  // zero-terminated, without a line feed; truncated when too long
};

/// Formats the text as printf does and returns `code`, so that a function can end with `return
/// message_set(message, ERROR_SYNTAX, ...)`. Control characters (a file name may contain any)
/// become '?', so that the message stays one line.
int message_set(struct message *message, int code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#ifdef __cplusplus
}
#endif

#endif

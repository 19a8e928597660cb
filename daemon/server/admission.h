// SPDX-License-Identifier: Apache-2.0
/// Checks a client's first line. A web page can send anything to a local port, so HTTP is never
/// answered, and TCP requires a token (daemon/files/token.h) that no page knows.
#ifndef VERGENCE_DAEMON_SERVER_ADMISSION_H
#define VERGENCE_DAEMON_SERVER_ADMISSION_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum admission {
    ADMISSION_LINE,   ///< handled like any other line
    ADMISSION_TOKEN,  ///< the right token, or a token where none is required: answer OK
    ADMISSION_WRONG,  ///< not the token, though one is required
    ADMISSION_HTTP,   ///< an HTTP request
};

/// Classifies the first non-blank line: `length` bytes without the line end (a line that is too
/// long may be cut). `token`: the required token, or NULL if none is required.
enum admission admission_of(const char *line, size_t length, const char *token);

#ifdef __cplusplus
}
#endif

#endif

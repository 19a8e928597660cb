// SPDX-License-Identifier: Apache-2.0
/// What the first line of a client may be. A web page can send what it likes to a port of this
/// machine, so that HTTP is never answered, and TCP needs a token (daemon/files/token.h) that no
/// page knows.
#ifndef VERGENCE_DAEMON_SERVER_ADMISSION_H
#define VERGENCE_DAEMON_SERVER_ADMISSION_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum admission {
    ADMISSION_LINE,   ///< to be treated as any other
    ADMISSION_TOKEN,  ///< the right token, or one where none is needed: to be answered OK
    ADMISSION_WRONG,  ///< not the token, which is needed
    ADMISSION_HTTP,   ///< a request of HTTP
};

/// Judges the first line that is not blank, `length` bytes without its end; one that is too long
/// may be cut. `token`: what is needed; NULL: nothing.
enum admission admission_of(const char *line, size_t length, const char *token);

#ifdef __cplusplus
}
#endif

#endif

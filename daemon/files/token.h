// SPDX-License-Identifier: Apache-2.0
/// The secret that a client sends first over TCP. The daemon creates it in a file that only its
/// owner can read; anyone who can read it may send commands.
#ifndef VERGENCE_DAEMON_FILES_TOKEN_H
#define VERGENCE_DAEMON_FILES_TOKEN_H

#include <stdbool.h>
#include <stddef.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    TOKEN_DIGITS = 64,
    TOKEN_BYTES = TOKEN_DIGITS + 1,  ///< including the terminating zero
    TOKEN_PATH_BYTES = 4096,
};

/// Prefix of the line "@token TOKEN".
#define TOKEN_PREFIX "@token "

/// Reads the token from the file `path` (shorter than TOKEN_PATH_BYTES); NULL or "": from the
/// default file, which daemon and client find by the same rule: vergence/tcp_token in
/// XDG_STATE_HOME if that is set, else in /var/lib for users who can write there (the service,
/// root), else in ~/.local/state. 0, or an error with a message that begins with the path:
/// ERROR_MISSING: no such file; ERROR_REFUSED: others can read it; ERROR_SYNTAX: not a token;
/// ERROR_IO.
int token_read(const char *path, char token[TOKEN_BYTES], struct message *message);

/// The same for the daemon: if the file does not exist, creates it with a new token, and the
/// directories of the default file. A file of another user is ERROR_REFUSED.
int token_open(const char *path, char token[TOKEN_BYTES], struct message *message);

/// Whether `given`, of `length` bytes, is the token; constant time.
bool token_is(const char token[TOKEN_BYTES], const char *given, size_t length);

#ifdef __cplusplus
}
#endif

#endif

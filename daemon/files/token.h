// SPDX-License-Identifier: Apache-2.0
/// The secret that a client over TCP gives before anything else. It stands in a file that its owner
/// alone can read: the daemon makes it, and who can read it may command.
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
    TOKEN_BYTES = TOKEN_DIGITS + 1,  ///< with its end
    TOKEN_PATH_BYTES = 4096,
};

/// The line "@token TOKEN" begins with this.
#define TOKEN_PREFIX "@token "

/// Reads the token of the file `path`, shorter than TOKEN_PATH_BYTES; NULL or "": of the default
/// one, which daemon and client find by the same rule: vergence/tcp_token in XDG_STATE_HOME where
/// that is set, else in /var/lib for users who can write there (the service, root), else in
/// ~/.local/state. 0, or an error with a message that begins with the path: ERROR_MISSING: there is
/// no such file; ERROR_REFUSED: others can read it; ERROR_SYNTAX: it holds no token; ERROR_IO.
int token_read(const char *path, char token[TOKEN_BYTES], struct message *message);

/// The same for the daemon: where there is no such file, makes one with a new token, and the
/// folders of the default one. A file of another user is ERROR_REFUSED.
int token_open(const char *path, char token[TOKEN_BYTES], struct message *message);

/// Whether `given`, of `length` bytes, is the token; takes as long for a wrong one.
bool token_is(const char token[TOKEN_BYTES], const char *given, size_t length);

#ifdef __cplusplus
}
#endif

#endif

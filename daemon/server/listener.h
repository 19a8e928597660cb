// SPDX-License-Identifier: Apache-2.0
/// Listening sockets, from which clients are accepted.
#ifndef VERGENCE_DAEMON_SERVER_LISTENER_H
#define VERGENCE_DAEMON_SERVER_LISTENER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/files/token.h"

/// Suffix of a socket's name until it listens.
#define LISTENER_BESIDE ".new"

enum { LISTENER_UNIX, LISTENER_TCP, LISTENERS };

/// Opens a Unix socket for its owner and group (mode 0660) in `*fd`, owned by the caller. A stale
/// socket is replaced. 0; ERROR_BUSY if another process listens there, ERROR_ARGUMENT (the path),
/// ERROR_IO. Errors set a message that begins with the path, and leave `*fd` unchanged.
int listener_unix(const char *path, int *fd, struct message *message);

/// Opens a TCP socket on 127.0.0.1 only in `*fd`, owned by the caller. 0, or ERROR_IO with a
/// message.
int listener_tcp(uint16_t port, int *fd, struct message *message);

/// Opens the socket `path` ("": none) and the port (0: none) in `fds`, and reads the token from the
/// file `token_path` (see token_open). Entries that are not opened are unchanged. 0, or an error
/// with a message that begins with the setting.
int listener_open(const char *path, uint16_t port, const char *token_path, int fds[LISTENERS],
                  char token[TOKEN_BYTES], struct message *message);

/// Accepts the next client, non-blocking; -1 if none is waiting.
int listener_accept(int fd);

/// Whether a client's first line is HTTP: a web page can send anything to a local port, so HTTP is
/// never answered. No console command is upper-case.
bool listener_is_http(const char *line, size_t length);

/// Answers that there are too many clients, and closes the connection.
void listener_turn_away(int fd);

#endif

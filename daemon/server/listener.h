// SPDX-License-Identifier: Apache-2.0
/// Listening sockets, from which clients are accepted.
#ifndef VERGENCE_DAEMON_SERVER_LISTENER_H
#define VERGENCE_DAEMON_SERVER_LISTENER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/files/token.h"
#include "daemon/settings/config.h"

/// Suffix of a socket's name until it listens.
#define LISTENER_BESIDE ".new"

enum { LISTENER_UNIX, LISTENER_TCP, LISTENERS };

enum { LISTENER_HOST_BYTES = 16 };

/// Opens a Unix socket for its owner and group (mode 0660) in `*fd`, owned by the caller. A stale
/// socket is replaced. 0; ERROR_BUSY if another process listens there, ERROR_ARGUMENT (the path),
/// ERROR_IO. Errors set a message that begins with the path, and leave `*fd` unchanged.
int listener_unix(const char *path, int *fd, struct message *message);

/// Opens a TCP socket in `*fd`, owned by the caller: on 127.0.0.1, or with `network` at all
/// addresses. 0, or ERROR_IO with a message.
int listener_tcp(uint16_t port, bool network, int *fd, struct message *message);

/// Opens the socket and the port of the settings in `fds`, and reads the token (see token_open).
/// Entries that are not set are unchanged. 0, or an error with a message that begins with the
/// setting.
int listener_open(const struct config *config, int fds[LISTENERS], char token[TOKEN_BYTES],
                  struct message *message);

/// Accepts the next client, non-blocking; -1 if none is waiting.
int listener_accept(int fd);

/// Whether a TCP client's address, which goes to `host`, is this machine's or of the settings'
/// network.
bool listener_admits(const struct config *config, int fd, char host[LISTENER_HOST_BYTES]);

/// Whether a client's first line is HTTP: a web page can send anything to a local port, so HTTP is
/// never answered. No console command is upper-case.
bool listener_is_http(const char *line, size_t length);

/// Answers with this line, and closes the connection.
void listener_turn_away(int fd, const char *line);

#endif

// SPDX-License-Identifier: Apache-2.0
/// Where clients come from: sockets that listen.
#ifndef VERGENCE_DAEMON_SERVER_LISTENER_H
#define VERGENCE_DAEMON_SERVER_LISTENER_H

#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/files/token.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What the name of a socket has behind it until it listens.
#define LISTENER_BESIDE ".new"

enum { LISTENER_UNIX, LISTENER_TCP, LISTENERS };

/// A Unix socket that its owner and group may use (mode 0660), in `*fd`, which is the caller's. One
/// that nobody listens on any more is replaced. 0; ERROR_BUSY when somebody does, ERROR_ARGUMENT
/// (the path), ERROR_IO, with a message that begins with the path, and `*fd` is left as it was.
int listener_unix(const char *path, int *fd, struct message *message);

/// TCP on 127.0.0.1 alone, in `*fd`, which is the caller's. 0, or ERROR_IO with a message.
int listener_tcp(uint16_t port, int *fd, struct message *message);

/// Opens the socket `path` ("": none) and the port (0: none), with the token that the file
/// `token_path` holds (see token_open), in `fds`; what is not opened is left as it was. 0, or an
/// error with a message that begins with the setting.
int listener_open(const char *path, uint16_t port, const char *token_path, int fds[LISTENERS],
                  char token[TOKEN_BYTES], struct message *message);

/// The next client; -1: none is there. What is accepted does not block.
int listener_accept(int fd);

/// Tells a client that there are too many, and closes its connection.
void listener_turn_away(int fd);

/// Turns a client away after accept() has failed for want of a descriptor (errno EMFILE or ENFILE;
/// else nothing is done), with the number of `spare_fd`, which is kept open for that.
void listener_turn_away_without_descriptor(int listener, int *spare_fd);

#ifdef __cplusplus
}
#endif

#endif

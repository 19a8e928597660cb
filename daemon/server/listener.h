// SPDX-License-Identifier: Apache-2.0
/// Where clients come from: sockets that listen.
#ifndef VERGENCE_DAEMON_SERVER_LISTENER_H
#define VERGENCE_DAEMON_SERVER_LISTENER_H

#include <stdint.h>
#include <sys/un.h>

#include "daemon/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What the name of a socket has behind it until it listens.
#define LISTENER_BESIDE ".new"

enum {
    /// Of a path that listener_unix can take, with its end.
    LISTENER_PATH_BYTES = sizeof(((struct sockaddr_un *)0)->sun_path) - sizeof LISTENER_BESIDE + 1
};

/// A Unix socket that its owner and group may use (mode 0660), in `*fd`, which is the caller's. One
/// that nobody listens on any more is replaced. 0; ERROR_BUSY when somebody does, ERROR_ARGUMENT
/// (the path), ERROR_IO, with a message that begins with the path, and `*fd` is left as it was.
int listener_unix(const char *path, int *fd, struct message *message);

/// TCP on 127.0.0.1 alone, in `*fd`, which is the caller's. 0, or ERROR_IO with a message.
int listener_tcp(uint16_t port, int *fd, struct message *message);

/// The next client; -1: none is there. What is accepted does not block.
int listener_accept(int fd);

/// Tells a client that there are too many, and closes its connection.
void listener_turn_away(int fd);

#ifdef __cplusplus
}
#endif

#endif

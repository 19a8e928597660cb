// SPDX-License-Identifier: Apache-2.0
/// Where clients come from: sockets that listen.
#ifndef VERGENCE_DAEMON_SERVER_LISTENER_H
#define VERGENCE_DAEMON_SERVER_LISTENER_H

#include <stdint.h>

#include "daemon/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A Unix socket that its owner and group may use (mode 0660). One that nobody listens on any more
/// is replaced; ERROR_BUSY when somebody does. The descriptor (>= 0), or ERROR_ARGUMENT (the path),
/// ERROR_IO, with a message.
int listener_unix(const char *path, struct message *message);

/// TCP on 127.0.0.1 alone.
int listener_tcp(uint16_t port, struct message *message);

/// The next client; -1: none is there. What is accepted does not block.
int listener_accept(int fd);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// A stream socket on which every operation has a deadline: connecting, sending, receiving.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_SOCKET_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_SOCKET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Connects to unix:PATH or tcp:HOST:PORT by a time of monotonic_now_ms. Returns the socket;
/// ERROR_ARGUMENT: `where` is neither form; ERROR_TIMEOUT; ERROR_IO: see `errno`, or 0: the host
/// has no address.
int sim_socket_connect(const char *where, int64_t deadline_ms);

/// Whether the other end has closed the connection.
bool sim_socket_has_ended(int socket);

/// Sends or receives all `bytes`. 0; ERROR_TIMEOUT; ERROR_IO: the other end has gone.
int sim_socket_send(int socket, const void *data, size_t bytes, int64_t deadline_ms);
int sim_socket_receive(int socket, void *data, size_t bytes, int64_t deadline_ms);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// A client of the daemon: a person at a terminal, or a program that sends lines. Owned by the
/// event loop, except for the job while a worker runs it.
#ifndef VERGENCE_DAEMON_SERVER_CONNECTION_H
#define VERGENCE_DAEMON_SERVER_CONNECTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/server/connection_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Allocates the output, and for a `terminal` also the buffer that keeps an answer. False: out of
/// memory.
bool connection_init(struct connection *self, struct server *server, int wake_fd, bool terminal);
void connection_destroy(struct connection *self);

/// Starts serving a new client.
void connection_begin(struct connection *self, enum connection_kind kind, int in_fd, int out_fd,
                      const char *name);
/// Requires the client that connected at `now_us` to greet first, with the token unless `token` is
/// NULL.
void connection_await_greeting(struct connection *self, const char *token, uint64_t now_us);
/// Does what is due: completes a finished job, starts the next line or round.
void connection_step(struct connection *self, uint64_t now_us);
/// When the next round of a watch is due; UINT64_MAX: never.
uint64_t connection_due_us(const struct connection *self);
/// Sends as much as the client accepts now.
void connection_send(struct connection *self, uint64_t now_us);
/// Whether the connection has ended and may be closed.
bool connection_over(struct connection *self);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// What a client has sent and nobody has taken yet. It is kept as far as there is room; what a
/// socket's client sends beyond that waits in the system, what a terminal's does is dropped while a
/// command runs, and told. A Ctrl-C is seen behind all of it.
#ifndef VERGENCE_DAEMON_SERVER_CONNECTION_INPUT_H
#define VERGENCE_DAEMON_SERVER_CONNECTION_INPUT_H

#include "daemon/server/connection.h"

#ifdef __cplusplus
extern "C" {
#endif

/// How many bytes it wants to read at most: none when it has more than it can use. A terminal is
/// read on while a command runs, for only so a Ctrl-C is seen.
size_t connection_input_room(const struct connection *self);
/// Bytes have come, or (`end`) no more will. What there is no room for is dropped, and is told.
void connection_input_receive(struct connection *self, const char *data, size_t bytes, bool end);
/// Whether a command runs that a Ctrl-C behind the full input could not cancel.
bool connection_input_is_deaf(const struct connection *self);
/// The bytes that are to come next, as far as they are known: a Ctrl-C among them counts now.
void connection_input_look_ahead(struct connection *self, const char *data, size_t bytes);

/// Whether what was dropped may not be over: more of it has just come.
bool connection_input_is_overflowing(const struct connection *self);

/// As Ctrl-C: what runs is cancelled, what was sent ahead is not begun.
void connection_input_cancel(struct connection *self);
/// What was dropped has been told: what is left of its last line is skipped.
void connection_input_end_overflow(struct connection *self);
/// The first bytes have been taken.
void connection_input_forget(struct connection *self, size_t bytes);

/// Whether a line ends here: CR or LF.
bool connection_input_is_line_end(char byte);

#ifdef __cplusplus
}
#endif

#endif

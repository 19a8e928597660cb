// SPDX-License-Identifier: Apache-2.0
/// Input that has been received and not yet used. It is buffered while there is room. Beyond that a
/// socket's input waits in the system, and a terminal's input is dropped while a command runs, and
/// reported. A Ctrl-C is recognised behind all of it.
#ifndef VERGENCE_DAEMON_SERVER_CONNECTION_INPUT_H
#define VERGENCE_DAEMON_SERVER_CONNECTION_INPUT_H

#include "daemon/server/connection_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// How many bytes may be read now; 0 while the buffer is full. A terminal is also read while a
/// command runs, as otherwise a Ctrl-C would not be seen.
size_t connection_input_room(const struct connection *self);
/// Adds bytes that were read; `end`: no more will follow. What does not fit is dropped and
/// reported.
void connection_input_receive(struct connection *self, const char *data, size_t bytes, bool end);
/// Whether a command runs that a Ctrl-C behind the full input could not cancel.
bool connection_input_is_paused(const struct connection *self);
/// Examines bytes that are pending but not read: a Ctrl-C among them takes effect now.
void connection_input_peek(struct connection *self, const char *data, size_t bytes);

/// Whether dropped input may still be arriving: more of it came just now.
bool connection_input_is_overflowing(const struct connection *self);

/// Acts as Ctrl-C: cancels what runs, discards what was sent ahead.
void connection_input_cancel(struct connection *self);
/// Ends an overflow that has been reported; the rest of its last line is skipped.
void connection_input_end_overflow(struct connection *self);
/// Removes the first `bytes` bytes, which have been used.
void connection_input_forget(struct connection *self, size_t bytes);

/// Handles the events `input` of poll() for the client's input at `now_us`: reads what is there,
/// looks for a Ctrl-C behind a full input, and notices its end.
void connection_input_take(struct connection *self, short input, uint64_t now_us);
/// Whether the byte ends a line: CR or LF.
bool connection_input_is_line_end(char byte);
/// The client has disconnected: cancels what runs or waits.
void connection_gone(struct connection *self);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// A client of the daemon: a person at a terminal, or a program that sends lines. Owned by the
/// event loop, except for the job while a worker runs it.
///
/// A client is not read while its buffer is full, so that what it sends ahead waits in the system.
/// A Ctrl-C in the buffer cancels what runs; what a person typed before it is discarded, and lines
/// of a program before it are answered without being run.
#ifndef VERGENCE_DAEMON_SERVER_CONNECTION_H
#define VERGENCE_DAEMON_SERVER_CONNECTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/line/editor.h"
#include "daemon/server/dispatch.h"

enum { CONNECTION_INPUT_BYTES = 16384 };

struct connection {
    struct dispatch *dispatch;
    bool used;
    bool terminal;  ///< prompt, echo, line editing
    bool program;   ///< a program uses the terminal (`@program`): no prompt, echo, editing
    bool framed;    ///< a program's lines are run only with a correct CRC (`@framed`)
    bool lasting;   ///< the daemon's own terminal: reopened after its end
    int in_fd, out_fd;
    bool greeted;          ///< a valid line has been received; over TCP, the token
    const char *token;     ///< required in the first line; NULL: none
    uint64_t begun_us;     ///< connection time of a client that has not greeted yet
    const char *hangs_up;  ///< why the daemon drops the client, for the log; NULL: it does not
    bool json, progress;   ///< enabled for all following lines
    bool ended;            ///< no more input: closed once everything is answered
    bool gone;             ///< the client has disconnected
    char input[CONNECTION_INPUT_BYTES];
    size_t input_bytes;
    bool skipping;        ///< dropping the rest of a line that was too long
    uint64_t watch_us;    ///< time at which the next round of a watch is due
    uint64_t life_us;     ///< time at which a heartbeat was last sent
    uint64_t stalled_us;  ///< time since which the client has not read; 0: it reads
    struct output output;
    struct job_payload payload;  ///< to be sent after `output`, before the next answer
    size_t payload_sent;
    struct job job;
    struct editor editor;
};

/// Allocates the output, which output_close frees. False: out of memory.
bool connection_init(struct connection *self, struct dispatch *dispatch, int wake_fd);

/// Starts serving a new client.
void connection_begin(struct connection *self, bool terminal, int in_fd, int out_fd);
/// Requires the client that connected at `now_us` to greet first, with the token unless `token` is
/// NULL.
void connection_await_greeting(struct connection *self, const char *token, uint64_t now_us);

/// Whether input can be taken: there is room in the buffer, and more may come.
bool connection_has_room(const struct connection *self);
/// Handles the events of poll() for the client's input: reads what is there, and notices its end.
void connection_read(struct connection *self, short events);
/// Does what is due: completes a finished job, starts the next line or round.
void connection_step(struct connection *self, uint64_t now_us);
/// When the next round of a watch is due; UINT64_MAX: never.
uint64_t connection_due_us(const struct connection *self);
/// Whether there is something to send.
bool connection_has_output(struct connection *self);
/// Sends as much as the client accepts now.
void connection_send(struct connection *self, uint64_t now_us);

/// The client has disconnected: cancels what runs or waits.
void connection_gone(struct connection *self);
/// Whether the connection has ended and may be closed.
bool connection_over(struct connection *self);

#endif

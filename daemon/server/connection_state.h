// SPDX-License-Identifier: Apache-2.0
/// The state of a connection, for the modules that it consists of.
#ifndef VERGENCE_DAEMON_SERVER_CONNECTION_STATE_H
#define VERGENCE_DAEMON_SERVER_CONNECTION_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/cli/editor.h"
#include "daemon/server/job.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CONNECTION_INPUT_BYTES = 16384,
    CONNECTION_NAME_BYTES = 64,
    CONNECTION_IDLE = 0x16  ///< SYN: a command of a CRC-framed line is running
};

enum connection_kind {
    CONNECTION_LINES,  ///< lines in, answers out
    /// Prompt, echo, line editing. `@program` switches to lines for a program, `@framed` to lines
    /// that are only run with a correct CRC.
    CONNECTION_TERMINAL,
};

struct server;

struct connection {
    bool used;
    bool greeted;          ///< a valid line has been received; over TCP, the token
    const char *token;     ///< required in the first line; NULL: none
    uint64_t begun_us;     ///< when a client that has not greeted yet connected
    const char *hangs_up;  ///< why the daemon drops the client, for the log; NULL: it does not
    bool lasting;          ///< the daemon's own terminal: reopened after its end
    enum connection_kind kind;
    bool program;  ///< a terminal used by a program
    bool framed;   ///< which frames its lines with a CRC
    int in_fd, out_fd;
    char name[CONNECTION_NAME_BYTES];
    struct server *server;
    struct output output;
    struct job job;
    bool json, progress;      ///< enabled for all following lines
    bool ended;               ///< no more input: closed once everything is answered
    bool gone;                ///< the client has disconnected
    int32_t last_request_id;  ///< id of the last command that is run at most once; REQUEST_ID_NONE
    char input[CONNECTION_INPUT_BYTES];
    size_t input_bytes;
    size_t refused_bytes;  ///< of these, bytes of lines that were followed by a Ctrl-C
    bool ctrl_c_ahead;     ///< a Ctrl-C follows more lines than fit
    uint64_t looked_us;    ///< when a Ctrl-C was last searched for
    uint64_t last_rx_us;   ///< when input was last received
    bool skipping;         ///< dropping the rest of a line that was too long
    bool overflowed;  ///< terminals only: input that arrived after the buffer filled was dropped
    bool dropping;    ///< the dropped input ends in the middle of a line
    size_t dropped_lines;
    uint64_t watch_us;    ///< when the next round of a watch is due
    uint64_t life_us;     ///< when a heartbeat was last sent
    uint64_t stalled_us;  ///< since when the client has not read; 0: it reads
    struct editor editor;
};

/// Whether a person is typing at this terminal.
bool connection_is_edited(const struct connection *self);
/// Whether a command or a watch is running.
bool connection_is_busy(const struct connection *self);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// A connection to the daemon: a socket, or a serial line with the daemon's console. Carries lines
/// of text both ways; a serial line may lose or damage bytes.
#ifndef VERGENCE_DAEMON_CLIENT_REMOTE_LINE_H
#define VERGENCE_DAEMON_CLIENT_REMOTE_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    REMOTE_LINE_BYTES = 256 * 1024,
    REMOTE_FOREVER_MS = -1,
    REMOTE_LINE_OPEN_MS = 4500  ///< time for the first answer; everything in less than 5 s
};

struct remote_line {
    int fd;
    bool serial, tcp;
    bool script;         ///< standard input instead: the end of its last line may be missing
    int errno_of_read;   ///< errno of a failed read of a script; 0: end of the script
    uint64_t opened_us;  ///< monotonic: when opening began
    char *data;          ///< REMOTE_LINE_BYTES of it
    size_t used, filled;
    bool skipping;        ///< skipping the rest of a line that was too long
    uint64_t last_rx_us;  ///< monotonic: last receipt of anything, keepalives included
    bool busy;            ///< that was FRAMING_BUSY
    bool framed;          ///< the peer has answered "@framed"
    uint64_t rx_bytes;    ///< bytes received in total, without keepalives
};

/// Opens `where`: unix:PATH, tcp:HOST:PORT, serial:DEVICE or serial:DEVICE:BAUD (115200). On a
/// serial line the console is switched to program mode: its lines carry CRCs, and its keepalives
/// are removed here (daemon/manual.md). Returns 0, or within REMOTE_LINE_OPEN_MS an error with a
/// message: ERROR_ARGUMENT for an invalid `where`; ERROR_IO of unix:PATH leaves the cause in errno.
int remote_line_open(struct remote_line *self, const char *where, struct message *message);
/// Time left for the first answer.
int remote_line_left_ms(const struct remote_line *self);
/// Closes the line; a serial console leaves program mode.
void remote_line_close(struct remote_line *self);

/// Sends bytes. False: connection lost.
bool remote_line_send(struct remote_line *self, const char *data, size_t bytes);

/// Receives the next line, without its end, into `*text`, valid until the next call; in place of
/// one that is too long, unless a serial line made it so, one that says so. 0; ERROR_TIMEOUT after
/// `limit_ms` (REMOTE_FOREVER_MS: never); ERROR_DEVICE: connection lost; ERROR_CANCELLED:
/// `extra_fd` (-1: none) is ready, see `*extra_ready`, or a signal came.
int remote_line_receive(struct remote_line *self, int limit_ms, int extra_fd, bool *extra_ready,
                        char **text);

/// Discards input until none has come for `quiet_ms`.
void remote_line_quiet(struct remote_line *self, int quiet_ms);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// A line to the daemon: a socket, or a serial line with the daemon's console at its other end.
/// Lines of text in both directions; on a serial line bytes may be lost or damaged.
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
    REMOTE_LINE_OPEN_MS = 4500  ///< until something must have answered; the whole in less than 5 s
};

struct remote_line {
    int fd;
    bool serial, tcp;
    uint64_t opened_us;  ///< monotonic: when its opening began
    char *data;          ///< REMOTE_LINE_BYTES of it
    size_t used, filled;
    bool skipping;         ///< the rest of a line that was too long
    uint64_t heard_us;     ///< monotonic: when something came last, also a sign of life alone
    uint64_t heard_bytes;  ///< all that ever came, without signs of life
};

/// Opens `where`: unix:PATH, tcp:HOST:PORT, serial:DEVICE or serial:DEVICE:BAUD (115200). On a
/// serial line the console is told that a program is here, which seals what it sends, and the signs
/// of life that it gives are no part of any line (daemon/README.md). 0, or within
/// REMOTE_LINE_OPEN_MS an error with a message: ERROR_ARGUMENT when `where` makes no sense;
/// ERROR_IO of unix:PATH leaves the cause in errno.
int remote_line_open(struct remote_line *self, const char *where, struct message *message);
/// How much is left of the time in which the other end must answer.
int remote_line_left_ms(const struct remote_line *self);
/// Tells a serial console that the program has gone.
void remote_line_close(struct remote_line *self);

/// Sends bytes. False: the line is broken.
bool remote_line_send(struct remote_line *self, const char *data, size_t bytes);

/// The next line, without its end, in `*text` until the next call. 0; ERROR_TIMEOUT after
/// `limit_ms` (REMOTE_FOREVER_MS: never); ERROR_DEVICE: the other end has gone; ERROR_CANCELLED:
/// `*extra_ready` (of another descriptor, -1: none) or a signal wants attention.
int remote_line_receive(struct remote_line *self, int limit_ms, int extra_fd, bool *extra_ready,
                        char **text);

/// Forgets what has come, until nothing has come for `quiet_ms`.
void remote_line_quiet(struct remote_line *self, int quiet_ms);

#ifdef __cplusplus
}
#endif

#endif

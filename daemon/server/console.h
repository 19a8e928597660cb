// SPDX-License-Identifier: Apache-2.0
/// The console: a serial line, which may go and come back, or standard input and output, whose
/// settings are others' as well and are put back. It takes the place of one client.
#ifndef VERGENCE_DAEMON_SERVER_CONSOLE_H
#define VERGENCE_DAEMON_SERVER_CONSOLE_H

#include <stdbool.h>
#include <stdint.h>
#include <termios.h>

#include "daemon/base/message.h"
#include "daemon/server/connection.h"
#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

struct console {
    const struct config *config;
    struct connection *client;  ///< its place
    bool stdio;                 ///< it is standard input and output
    bool stdio_raw;
    int stdio_flags[2];  ///< of standard input and output, before; others share them
    struct termios stdio_settings;
    uint64_t retry_us;
};

/// Opens the console that the settings name, if any: a terminal with line editing where it is one.
/// `client` is a connection without a use and outlives it. 0, or an error with a message.
int console_open(struct console *self, const struct config *config, struct connection *client,
                 struct message *message);

/// Puts the settings of standard input and output back. Not needed where console_open never was.
void console_close(struct console *self);

/// Whether this client has the daemon's own input and output, which others may share.
bool console_is_stdio(const struct console *self, const struct connection *client);

/// A serial console is over (`gone`: the line itself failed); console_retry brings it back.
void console_left(struct console *self, bool gone);

/// A serial console that has gone may come back (an adapter that is plugged in again).
void console_retry(struct console *self, uint64_t now_us);

#ifdef __cplusplus
}
#endif

#endif

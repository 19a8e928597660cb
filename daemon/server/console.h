// SPDX-License-Identifier: Apache-2.0
/// The console: a serial line, which may disappear and return, or standard input and output, whose
/// settings are shared with other processes and are restored. It occupies one client slot.
#ifndef VERGENCE_DAEMON_SERVER_CONSOLE_H
#define VERGENCE_DAEMON_SERVER_CONSOLE_H

#include <stdbool.h>
#include <stdint.h>
#include <termios.h>

#include "daemon/base/message.h"
#include "daemon/server/connection.h"
#include "daemon/settings/config.h"

struct console {
    const struct config *config;
    struct connection *client;  ///< its client slot
    bool stdio;                 ///< the console is standard input and output
    bool stdio_raw;
    int stdio_flags[2];  ///< original flags of standard input and output, which others share
    struct termios stdio_settings;
    uint64_t retry_us;
};

/// Opens the console that the settings name, if any; with line editing if it is a terminal.
/// `client` is an unused connection and outlives the console. 0, or an error with a message.
int console_open(struct console *self, const struct config *config, struct connection *client,
                 struct message *message);

/// Restores the settings of standard input and output. Not needed if console_open was not called.
void console_close(struct console *self);

/// Whether this client uses the daemon's own standard input and output, which others may share.
bool console_is_stdio(const struct console *self, const struct connection *client);

/// Reports that a serial console has ended (`gone`: the line itself failed); console_retry reopens
/// it.
void console_left(struct console *self, bool gone);

/// Tries to reopen a serial console that has disappeared (an adapter that is plugged in again).
void console_retry(struct console *self, uint64_t now_us);

#endif

// SPDX-License-Identifier: Apache-2.0
/// The daemon's event loop: accepts clients, turns their lines into jobs of the two workers, sends
/// the answers. It waits in one poll() for all events and blocks nowhere else.
#ifndef VERGENCE_DAEMON_SERVER_SERVER_H
#define VERGENCE_DAEMON_SERVER_SERVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/server/connection.h"
#include "daemon/server/console.h"
#include "daemon/server/daemon.h"
#include "daemon/server/listener.h"

struct server {
    struct daemon *daemon;  ///< NULL: not open
    struct dispatch dispatch;
    struct connection *clients[CONFIG_CLIENTS_MAX + 1];  ///< the first one is the console
    size_t client_count;
    int listeners[LISTENERS];  ///< -1: none
    char token[TOKEN_BYTES];   ///< required of TCP clients
    int signal_fd, wake_fd;
    uint64_t accept_us;  ///< no client is accepted before, as no descriptor was left
    struct console console;
    bool stopping, stuck_reported;
    uint64_t notify_us;  ///< heartbeat period
    uint64_t notified_us;
    bool watchdog_reported;  ///< a failed feed was logged
};

/// Blocks the signals that the loop handles, so call it before starting threads; opens sockets and
/// terminal. `daemon` outlives the server. 0, or an error with a message. Call server_close also
/// after an error.
int server_open(struct server *self, struct daemon *daemon, struct message *message);

/// Starts the daemon's workers; the rig is initialised. 0, or an error with a message.
int server_start(struct server *self, struct message *message);

/// Runs until SIGTERM or SIGINT, or until the end of a console on standard input. Returns 0.
int server_run(struct server *self);

/// Ends the workers (which makes the rig safe) and closes everything.
void server_close(struct server *self);

#endif

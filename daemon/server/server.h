// SPDX-License-Identifier: Apache-2.0
/// The daemon's event loop: clients come and go, their lines become jobs of the two crews, answers
/// go back. It waits in one place, for everything at once, and nobody can make it wait elsewhere.
#ifndef VERGENCE_DAEMON_SERVER_SERVER_H
#define VERGENCE_DAEMON_SERVER_SERVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/reply/logbook.h"
#include "daemon/server/connection.h"
#include "daemon/server/console.h"
#include "daemon/server/crew.h"
#include "daemon/server/listener.h"
#include "daemon/settings/config.h"
#include "hal/watchdog.h"

#ifdef __cplusplus
extern "C" {
#endif

struct server {
    const struct config *config;
    struct logbook *logbook;
    const struct command *table;
    size_t table_count;
    struct crew rig_crew, desk_crew;
    struct connection_host host;
    struct connection clients[CONFIG_CLIENTS_MAX + 1];  ///< the first is the console
    size_t client_count;
    struct reply reply;
    int listeners[LISTENERS];  ///< -1: none
    char token[TOKEN_BYTES];   ///< of clients over TCP
    int signal_fd, wake_fd;
    int spare_fd;  ///< given up to turn a client away when there is none left
    struct console console;
    bool stopping, stuck_told;
    uint64_t notify_us;  ///< between two signs of life
    uint64_t notified_us;
    const struct hal_watchdog *watchdog;  ///< NULL: none
    bool watchdog_told;                   ///< that it cannot be fed
};

/// What the server works with. All of it must outlive it.
struct server_parts {
    const struct config *config;
    struct logbook *logbook;
    const struct hal_log *log;
    const struct hal_store *store;
    struct record *record;
    struct scribe *scribe;
    bool (*idle_is_next)(void *replay);  ///< see struct surroundings
    bool (*cancel_is_next)(void *replay);
    void (*pair_was_taken)(void *replay);
    void *replay;
    void (*put_devices)(void *devices, const struct command_call *call);  ///< as there
    void *devices;
    int files_fd;
    const struct command *table;
    size_t table_count;
    struct rig *rig;
    const struct hal_watchdog *watchdog;  ///< armed; NULL: none
    bool time_passes;                     ///< the rig's clock goes on by itself
};

/// Blocks the signals that the loop takes, before any thread begins; opens sockets and terminal.
/// 0, or an error with a message. The rig must have been given `crew_observer(&rig_crew)` before
/// server_run; server_close is needed also after an error.
int server_open(struct server *self, const struct server_parts *parts, struct message *message);

/// Starts the crews.  0 or an error with a message.
int server_start(struct server *self, struct message *message);

/// Runs until SIGTERM or SIGINT, or until the end of a console on standard input. Returns 0.
int server_run(struct server *self);

/// Ends the crews (the rig becomes safe) and closes all.
void server_close(struct server *self);

#ifdef __cplusplus
}
#endif

#endif

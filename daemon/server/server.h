// SPDX-License-Identifier: Apache-2.0
/// The daemon's event loop: accepts clients, turns their lines into jobs of the two workers, sends
/// the answers. It waits in one poll() for all events and blocks nowhere else.
#ifndef VERGENCE_DAEMON_SERVER_SERVER_H
#define VERGENCE_DAEMON_SERVER_SERVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/reply/log_ring.h"
#include "daemon/server/connection.h"
#include "daemon/server/console.h"
#include "daemon/server/listener.h"
#include "daemon/server/worker.h"
#include "daemon/settings/config.h"
#include "hal/watchdog.h"

#ifdef __cplusplus
extern "C" {
#endif

struct server {
    const struct config *config;
    struct log_ring *log_ring;
    const struct command *table;
    size_t table_count;
    struct worker rig_worker, general_worker;
    struct connection_host host;
    struct connection clients[CONFIG_CLIENTS_MAX + 1];  ///< the first one is the console
    size_t client_count;
    struct reply reply;
    int listeners[LISTENERS];  ///< -1: none
    char token[TOKEN_BYTES];   ///< required of TCP clients
    int signal_fd, wake_fd;
    int reserve_fd;  ///< released to reject a client when no descriptor is left
    struct console console;
    bool stopping, stuck_reported;
    uint64_t notify_us;  ///< heartbeat period
    uint64_t notified_us;
    const struct hal_watchdog *watchdog;  ///< NULL: none
    bool watchdog_reported;               ///< a failed feed was logged
};

/// What the server uses. All of it must outlive the server.
struct server_parts {
    const struct config *config;
    struct log_ring *log_ring;
    const struct hal_log *log;
    const struct hal_store *store;
    struct record *record;
    struct disk_writer *disk_writer;
    bool (*idle_is_next)(void *replay);  ///< see struct command_context
    bool (*cancel_is_next)(void *replay);
    void (*pair_was_taken)(void *replay);
    void *replay;
    void (*reply_devices)(void *devices,
                          const struct command_call *call);  ///< see struct command_context
    void *devices;
    int files_fd;
    const struct command *table;
    size_t table_count;
    struct rig *rig;
    const struct hal_watchdog *watchdog;  ///< already armed; NULL: none
    bool time_passes;                     ///< the rig's clock runs in real time
};

/// Blocks the signals that the loop handles, so call it before starting threads; opens sockets and
/// terminal. 0, or an error with a message. Pass `worker_observer(&rig_worker)` to the rig before
/// server_run. Call server_close also after an error.
int server_open(struct server *self, const struct server_parts *parts, struct message *message);

/// Starts the workers. 0, or an error with a message.
int server_start(struct server *self, struct message *message);

/// Runs until SIGTERM or SIGINT, or until the end of a console on standard input. Returns 0.
int server_run(struct server *self);

/// Ends the workers (which makes the rig safe) and closes everything.
void server_close(struct server *self);

#ifdef __cplusplus
}
#endif

#endif

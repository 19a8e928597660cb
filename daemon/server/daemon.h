// SPDX-License-Identifier: Apache-2.0
/// All that the daemon's parts share: the context of its commands (`context` of a command_call).
///
/// Commands flagged COMMAND_NO_RIG run on the general worker's thread and must not use the rig,
/// except its profile, which never changes.
#ifndef VERGENCE_DAEMON_SERVER_DAEMON_H
#define VERGENCE_DAEMON_SERVER_DAEMON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command.h"
#include "daemon/server/log_ring.h"
#include "daemon/server/worker.h"
#include "daemon/session/disk_writer.h"
#include "daemon/session/last_pair.h"
#include "daemon/session/record.h"
#include "daemon/settings/config.h"
#include "hal/store.h"
#include "hal/watchdog.h"
#include "rig/rig.h"

struct v4l2_camera;

/// Use static storage: it is large, and must not move.
struct daemon {
    struct config config;
    const struct command *table;  ///< all commands, by name
    size_t table_count;
    struct log_ring log_ring;
    struct hal_log log;                            ///< writes to `log_ring`
    const struct hal_store *store;                 ///< NULL: nothing can be saved
    const struct hal_watchdog *watchdog;           ///< already armed; NULL: none
    int files_fd;                                  ///< directory of files for clients; -1: not set
    struct rig rig;                                ///< the rig worker's thread only
    const struct v4l2_camera *cameras[RIG_SIDES];  ///< behind the rig's ports; NULL: none
    struct record record;            ///< in front of the rig's ports; records on request
    struct disk_writer disk_writer;  ///< for the rig worker's thread only
    struct last_pair last_pair;      ///< for `reconstruct`
    struct worker rig_worker, general_worker;
    uint64_t started_us;  ///< monotonic
};

/// The daemon, and the running job, of a call.
static inline struct daemon *daemon_of(const struct command_call *call) {
    return (struct daemon *)call->context;
}
static inline struct job *job_of(const struct command_call *call) {
    return (struct job *)call->job;
}

/// True: the command must end soon with ERROR_CANCELLED. Any thread.
static inline bool daemon_should_stop(const struct command_call *call) {
    return worker_should_stop(job_of(call)->worker);
}

/// Reports progress, `done` of `total`; `what` is static storage. The command's thread only.
static inline void daemon_progress(const struct command_call *call, const char *what, uint32_t done,
                                   uint32_t total) {
    worker_progress(job_of(call)->worker, what, done, total);
}

#endif

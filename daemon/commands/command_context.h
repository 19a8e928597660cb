// SPDX-License-Identifier: Apache-2.0
/// What a command of the daemon may use in addition to the rig: `context` of its command_call.
/// A module with commands has a table of them (`const struct command *NAME_table(size_t *count)`),
/// which main_vergenced.c adds to the others.
///
/// Commands flagged COMMAND_NO_RIG run on another thread and must not use `call->rig`, except its
/// profile, which never changes.
#ifndef VERGENCE_DAEMON_COMMANDS_COMMAND_CONTEXT_H
#define VERGENCE_DAEMON_COMMANDS_COMMAND_CONTEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command.h"
#include "hal/log.h"
#include "hal/store.h"

#ifdef __cplusplus
extern "C" {
#endif

struct config;
struct job;
struct log_ring;
struct record;
struct disk_writer;

/// Name of the calibration's record in the store, and maximum length of its canonical text.
#define STORE_CALIBRATION "calibration"
enum { STORE_CALIBRATION_BYTES = 4096 };

struct command_context {
    const struct config *config;
    const struct command *table;  ///< all commands
    size_t table_count;
    const struct hal_log *log;
    struct log_ring *log_ring;        ///< behind `log`: the last lines
    struct record *record;            ///< in front of the rig's ports; records on request
    struct disk_writer *disk_writer;  ///< disk writer, for the rig's thread only
    /// Replay: whether the rig idled at this point of the recording. NULL: no replay.
    bool (*idle_is_next)(void *replay);
    /// Replay: whether the running command was cancelled at this point. NULL: no replay.
    bool (*cancel_is_next)(void *replay);
    /// Replay of images: advances to the next pair. NULL: no replay of images.
    void (*pair_was_taken)(void *replay);
    void *replay;
    /// Adds the devices behind the rig's ports to the answer, on the rig's thread. NULL: no
    /// devices.
    void (*reply_devices)(void *devices, const struct command_call *call);
    void *devices;
    uint64_t started_us;            ///< monotonic time of the daemon's start
    const struct hal_store *store;  ///< NULL: nothing can be saved
    struct job *job;                ///< the running job, for commands that change it
    int files_fd;  ///< directory of sessions and other results for clients; -1: not set

    /// True: the running command must end soon with ERROR_CANCELLED. Any thread.
    bool (*should_stop)(void *self);
    /// Reports progress, `done` of `total`; `what` is static storage. The command's thread only.
    void (*progress)(void *self, const char *what, uint32_t done, uint32_t total);
    void *self;
};

/// The context of a call.
static inline const struct command_context *context_of(const struct command_call *call) {
    return (const struct command_context *)call->context;
}

/// Formats the message of a call as by printf, control characters replaced. Returns `error`, < 0.
int command_fail(const struct command_call *call, int error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// The same for an error of the store: "`subject`: cannot `action` the store PATH: reason", where
/// `action` is "save to", "read from" or "remove from". Returns `error`.
int command_fail_store(const struct command_call *call, int error, const char *subject,
                       const char *action);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// What a command of the daemon may use beside the rig: `surroundings` of its command_call. A
/// module with commands of its own offers a table of them (`const struct command
/// *NAME_table(size_t *count)`) that main_vergenced.c adds to the others.
///
/// Commands flagged COMMAND_NO_RIG run on a thread of their own and must leave `call->rig` alone
/// but for its profile, which never changes.
#ifndef VERGENCE_DAEMON_COMMANDS_SURROUNDINGS_H
#define VERGENCE_DAEMON_COMMANDS_SURROUNDINGS_H

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
struct logbook;
struct record;
struct scribe;

/// The calibration's record in the store: its canonical text, and how long it is at most.
#define SURROUNDINGS_CALIBRATION "calibration"
enum { SURROUNDINGS_CALIBRATION_BYTES = 4096 };

struct surroundings {
    const struct config *config;
    const struct command *table;  ///< all commands
    size_t table_count;
    const struct hal_log *log;
    struct logbook *logbook;  ///< behind `log`: its last lines
    struct record *record;    ///< in front of the rig's ports; recording when told to
    struct scribe *scribe;    ///< writes for the thread that has the rig, and for no other
    /// Of a recording that is played: whether the rig idled here. NULL: none is played.
    bool (*idle_is_next)(void *replay);
    /// Likewise: whether the command that runs was cancelled here.
    bool (*cancel_is_next)(void *replay);
    /// Of a session that is played: the next pair is to come. NULL: none is played.
    void (*pair_was_taken)(void *replay);
    void *replay;
    /// Tells of the devices behind the rig's ports, on the rig's thread. NULL: there are none.
    void (*put_devices)(void *devices, const struct command_call *call);
    void *devices;
    uint64_t started_us;            ///< when the daemon was, by its monotonic clock
    const struct hal_store *store;  ///< NULL: nothing can be kept
    struct job *job;                ///< the one that runs, for commands that outlast one run
    int files_fd;  ///< the directory of sessions and other results that clients fetch; -1: none

    /// Of the command that runs. False: it is to end soon with ERROR_CANCELLED. Any thread.
    bool (*go_on)(void *self);
    /// `done` of `total`; `what` is static storage. The command's own thread only.
    void (*progress)(void *self, const char *what, uint32_t done, uint32_t total);
    void *self;
};

/// Those of a call.
static inline const struct surroundings *surroundings_of(const struct command_call *call) {
    return (const struct surroundings *)call->surroundings;
}

/// Writes the message of a call as printf would and returns `error`.
int surroundings_refuse(const struct command_call *call, int error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// The same for what the store did not do: `subject` ("settings: they") cannot be `done` ("kept",
/// "read", "removed") there, and why. Returns `error`.
int surroundings_refuse_store(const struct command_call *call, int error, const char *subject,
                              const char *done);

#ifdef __cplusplus
}
#endif

#endif

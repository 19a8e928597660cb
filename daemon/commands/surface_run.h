// SPDX-License-Identifier: Apache-2.0
/// A reconstruction of a pair of the instrument, for the commands that make surfaces.
#ifndef VERGENCE_DAEMON_COMMANDS_SURFACE_RUN_H
#define VERGENCE_DAEMON_COMMANDS_SURFACE_RUN_H

#include "daemon/commands/files.h"
#include "daemon/server/daemon.h"
#include "daemon/surface/reconstruct_job.h"
#include "daemon/surface/reconstruct_session.h"

/// Files that are written by default: a client makes all others of them. And the word for all.
#define SURFACE_RUN_FILES "surface.compact,result.json"
#define SURFACE_RUN_ALL "all"

/// One run. Allocate it zeroed: it is large.
struct surface_run {
    // Set by the caller:
    struct daemon *daemon;
    char session[FILES_NAME_MAX + 1];  ///< below "files"; of a pair in memory: its name
    struct captured_pair *captured;    ///< the pair in memory, given back at the end; NULL: none
    struct reconstruct_request request;
    bool frees_maps;  ///< see reconstruct_job.h
    bool keep;  ///< write the results to "files"; else only `job.result` is made, with its points
    struct output_sink sink;  ///< has `put`: surface.compact goes there, and nothing to "files"
    bool (*should_stop)(void *self);
    void (*progress)(void *self, int stage, const char *what, int done, int total);
    void *self;  ///< of both

    // After surface_run:
    char result[FILES_NAME_MAX + 64];  ///< directory of the results below "files", if kept
    char message[MESSAGE_BYTES];       ///< why it failed
    struct reconstruct_job job;        ///< until surface_run_end
    struct reconstruct_session source;

    char out_path[ATOMIC_DIR_PATH_BYTES];
    char *stored;  // the saved calibration; NULL: none, or not read
    struct reconstruct_caller caller;
    // Of surface_run_beside:
    const struct command_call *call;
    int error;
    atomic_bool stop;
    const char *_Atomic stage;
    atomic_int done, total;
};

/// Runs it on the calling thread, which need not be the rig's. Errors of reconstruct_job_run, with
/// ERROR_IO for results that cannot be written. surface_run_end is required in any case.
int surface_run(struct surface_run *self);

/// The same on a thread of its own, for a command of the rig's thread, which looks after the rig
/// meanwhile, shows the progress and may be cancelled. Sets `daemon` and the observer.
int surface_run_beside(struct surface_run *self, const struct command_call *call);

/// Frees what it uses, but not `self`.
void surface_run_end(struct surface_run *self);

#endif

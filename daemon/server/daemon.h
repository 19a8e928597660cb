// SPDX-License-Identifier: Apache-2.0
/// All that the daemon's parts share: the context of its commands (`context` of a command_call),
/// and the two workers that run them.
///
/// A worker is a thread that runs jobs one after the other: one owns the rig and services it
/// between jobs, the other runs commands that need no rig. A job is a client's command: parsed by
/// the event loop, run by a worker. Each connection has one job, so a client's commands run one
/// after the other.
///
/// Commands flagged COMMAND_NO_RIG run on the general worker's thread and must not use the rig,
/// except its profile, which never changes.
#ifndef VERGENCE_DAEMON_SERVER_DAEMON_H
#define VERGENCE_DAEMON_SERVER_DAEMON_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command.h"
#include "console/line/reply.h"
#include "console/pair/calibration_match.h"
#include "daemon/server/log_ring.h"
#include "daemon/server/output.h"
#include "daemon/session/disk_writer.h"
#include "daemon/session/last_pair.h"
#include "daemon/session/record.h"
#include "daemon/session/session_write.h"
#include "daemon/settings/config.h"
#include "hal/store.h"
#include "hal/watchdog.h"
#include "rig/rig.h"

struct v4l2_camera;

struct daemon;
struct worker;

enum { JOB_MESSAGE_BYTES = 1024, JOB_LINE_BYTES = REQUEST_PREFIX_MAX + COMMAND_LINE_MAX + 2 };

enum { DAEMON_STAGES_MAX = 8 };

/// Value of `ahead_shown`: the client has not been informed that its job waits.
#define JOB_NOT_SHOWN UINT32_MAX

enum job_state {
    JOB_FREE,     ///< owned by the event loop
    JOB_WAITING,  ///< queued or running; owned by the worker
    JOB_DONE,     ///< the answer is in the output; owned by the event loop
};

/// A command repeated by `watch`.
struct job_watch {
    bool on;
    uint64_t interval_us;
    uint32_t rounds_left;  ///< 0: until cancelled
    char line[COMMAND_LINE_MAX + 1];
};

/// Bytes that follow an answer, allocated by malloc.
struct job_payload {
    uint8_t *data;  ///< NULL: none
    size_t bytes;
};

struct job {
    atomic_int state;       ///< enum job_state
    atomic_bool cancelled;  ///< the client has cancelled the command
    struct worker *worker;  ///< runs it
    struct output *output;
    bool terminal;
    struct request request;
    const struct command *command;
    char line[COMMAND_LINE_MAX + 1];  ///< the command line as entered
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    struct job_watch watch;
    bool round;                  ///< a round of `watch`: answered only if it fails or is the last
    bool quit;                   ///< close the connection
    struct job_payload payload;  ///< set by the command, sent after its answer

    // While it is queued. Used by both threads, under the worker's lock.
    uint64_t queued_us;    ///< monotonic time at which it was queued
    uint32_t ahead;        ///< commands before it at that time
    uint32_t ahead_shown;  ///< last number shown to the client, or JOB_NOT_SHOWN
    int bar_columns;       ///< width of a bar on its terminal, to be erased by the answer; 0: none
};

struct worker {
    pthread_t thread;
    bool started;
    pthread_mutex_t lock;
    pthread_cond_t wakeup;  ///< a job was queued, or `stopping` was set
    struct job *waiting[CONFIG_QUEUE_MAX];
    size_t first, count, capacity;
    struct job *running;            ///< owned by the thread; changed under the lock
    enum rig_state reported_state;  ///< last state that was logged
    bool cut_reported;              ///< a cut-off recording was logged
    atomic_bool stopping;
    _Atomic uint64_t alive_us;  ///< monotonic time at which the thread last made progress

    struct daemon *daemon;
    bool has_rig;  ///< services the rig and leaves it in its safe state
    int wake_fd;   ///< eventfd that wakes the event loop when a job is done
    struct reply reply;
    uint64_t progress_us;  ///< time at which progress was last shown
    const char *progress_what;
};

/// The session being written: a recording, or one pair. The rig worker's thread, and the disk
/// writer for it.
struct session {
    struct session_writer writer;
    bool recording;
    char name[CAPTURED_PAIR_NAME_BYTES];
};

/// How well the saved calibration fits, for all threads: what the last pair that it was adjusted by
/// showed, and what has happened since it was set.
struct daemon_health {
    _Atomic int64_t set_s;  ///< time when the calibration was set, s since 1970; 0: unknown
    _Atomic uint32_t
        moves;  ///< commands since `set_s`, or since the start, that moved pan, zoom, focus
    atomic_bool is_adjusted;
    _Atomic uint32_t rows_milli_px, depth_sigma_um, depth_um;
    _Atomic(const char *) word;  ///< verdict from adjust_health_text
};

/// Where pan, zoom and focus were commanded to.
struct daemon_axes {
    int32_t at[RIG_SIDES][3];
};
struct daemon_axes daemon_axes_of(const struct rig *rig);

/// The last `view`, by whose pixels `measure` takes a place. The rig worker's thread only.
struct daemon_view {
    bool taken;
    struct daemon_axes axes;             ///< at which it was taken
    struct calibration_match_state now;  ///< where the axes were then
    int width_px, height_px;             ///< of one half of the picture
    int step_px;                         ///< pixels of the sensor for one of the picture
    uint16_t column_px[RIG_SIDES], row_px[RIG_SIDES];  ///< of the first pixel on the sensor
};

/// Use static storage: it is large, and must not move.
struct daemon {
    struct config config;
    struct command_table table;  ///< all commands, by name
    struct log_ring log_ring;
    struct hal_log log;                            ///< writes to `log_ring`
    const struct hal_store *store;                 ///< NULL: nothing can be saved
    const struct hal_watchdog *watchdog;           ///< already armed; NULL: none
    int files_fd;                                  ///< directory of files for clients; -1: not set
    struct rig rig;                                ///< the rig worker's thread only
    const struct v4l2_camera *cameras[RIG_SIDES];  ///< cameras behind the rig's ports; NULL: none
    struct record record;            ///< recorder in front of the rig's ports; records on request
    struct disk_writer disk_writer;  ///< used by the rig worker's thread only
    struct session session;
    struct last_pair last_pair;  ///< the pair that `reconstruct` uses
    struct daemon_view view;
    struct daemon_health health;
    /// Stages of the last reconstruction, and the memory that each took; a name of NULL: none.
    struct {
        const char *_Atomic name;
        _Atomic uint64_t peak_bytes;
    } stages[DAEMON_STAGES_MAX];
    struct worker rig_worker, general_worker;
    uint64_t started_us;  ///< monotonic
};

/// Observer of the rig's long calls, for rig_init; for the worker that owns the rig.
struct rig_observer worker_observer(struct worker *self);

/// Starts the thread. `wake_fd`: eventfd that wakes the event loop when a job is done; `capacity`:
/// 1 .. CONFIG_QUEUE_MAX. The worker with the rig is the daemon's `rig_worker`. False: the thread
/// cannot be created.
bool worker_start(struct worker *self, struct daemon *daemon, int wake_fd, size_t capacity);

/// Whether the running command must end, and what it reports: see daemon_should_stop and
/// daemon_progress.
bool worker_should_stop(struct worker *self);
void worker_progress(struct worker *self, const char *what, uint32_t done, uint32_t total);

/// Sends the running job's client bytes ahead of the answer, as fast as it reads, until the command
/// must end. Only before the first item.
void worker_send(struct worker *self, const void *data, size_t bytes);

/// Cancels the running job, answers those that wait, makes the rig safe and ends the thread.
void worker_stop(struct worker *self);

/// Cancels the running job, as its client would.
void worker_cancel(struct worker *self);

/// Queues a job whose state is JOB_WAITING. False: the queue is full.
bool worker_submit(struct worker *self, struct job *job);

/// Takes back a job that has not been started; the caller owns it again and must answer it. False:
/// it is running or done.
bool worker_withdraw(struct worker *self, struct job *job);

/// Reports to a client whose job has waited for a while which command it waits for, once for each,
/// as progress on the caller's `reply`.
void worker_report_wait(struct worker *self, struct job *job, struct reply *reply, uint64_t now_us);

/// Time since the thread last made progress, in us.
uint64_t worker_silence_us(const struct worker *self);

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

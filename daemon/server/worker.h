// SPDX-License-Identifier: Apache-2.0
/// A worker thread that runs jobs one after the other. There are two: one owns the rig and services
/// it between jobs, the other runs commands that need no rig.
#ifndef VERGENCE_DAEMON_SERVER_WORKER_H
#define VERGENCE_DAEMON_SERVER_WORKER_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "daemon/commands/command_context.h"
#include "daemon/reply/job.h"
#include "daemon/reply/reply.h"
#include "daemon/settings/config.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

struct worker {
    pthread_t thread;
    bool started;
    pthread_mutex_t lock;
    pthread_cond_t wakeup;  ///< a job was queued, or `stopping` was set
    struct job *waiting[CONFIG_QUEUE_MAX];
    size_t first, count, capacity;
    struct job *running;            ///< owned by the thread; changed under the lock
    bool cancel_recorded;           ///< the cancellation of `running` is recorded
    enum rig_state reported_state;  ///< last state that was logged
    bool cut_reported;              ///< a cut-off recording was logged
    atomic_bool stopping;
    _Atomic uint64_t alive_us;  ///< monotonic time at which the thread last made progress

    struct rig *rig;   ///< a worker without the rig uses only its profile
    bool has_rig;      ///< services the rig and leaves it in its safe state
    bool time_passes;  ///< in real time; if not, nothing is due between jobs
    int wake_fd;       ///< eventfd that wakes the event loop when a job is done
    struct reply reply;
    struct command_context context;
    uint64_t progress_us;  ///< when progress was last shown
    const char *progress_what;
};

/// Observer of the rig's long calls, for rig_init; for the worker that owns the rig.
struct rig_observer worker_observer(struct worker *self);

/// Starts the thread. The caller sets all fields from `rig` to `wake_fd`, and `context` except
/// `started_us` and its last three fields; `capacity` is 1 .. CONFIG_QUEUE_MAX. False: the thread
/// cannot be created.
bool worker_start(struct worker *self, size_t capacity);

/// Cancels the running job, answers those that wait, makes the rig safe and ends the thread.
void worker_stop(struct worker *self);

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

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// A worker thread that runs jobs one after the other. There are two: one owns the rig and services
/// it between jobs, the other runs commands that need no rig.
#ifndef VERGENCE_DAEMON_SERVER_WORKER_H
#define VERGENCE_DAEMON_SERVER_WORKER_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "daemon/server/job.h"
#include "daemon/server/reply.h"
#include "daemon/settings/config.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

struct daemon;

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
    uint64_t progress_us;  ///< when progress was last shown
    const char *progress_what;
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

#ifdef __cplusplus
}
#endif

#endif

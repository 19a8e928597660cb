// SPDX-License-Identifier: Apache-2.0
/// A thread that carries out jobs one after the other. There are two: one has the rig and looks
/// after it in between, the other does what needs no rig.
#ifndef VERGENCE_DAEMON_SERVER_CREW_H
#define VERGENCE_DAEMON_SERVER_CREW_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "daemon/commands/surroundings.h"
#include "daemon/reply/job.h"
#include "daemon/reply/reply.h"
#include "daemon/settings/config.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

struct crew {
    pthread_t thread;
    bool started;
    pthread_mutex_t lock;
    pthread_cond_t news;  ///< a job, or `stopping`
    struct job *waiting[CONFIG_QUEUE_MAX];
    size_t first, count, capacity;
    struct job *running;        ///< the thread's; changed under the lock
    bool cancel_recorded;       ///< that `running` is to end
    enum rig_state told_state;  ///< what the log knows of it
    bool cut_told;              ///< that the recording is cut off
    atomic_bool stopping;
    _Atomic uint64_t alive_us;  ///< monotonic; the thread was seen going on

    struct rig *rig;   ///< those without the rig use its profile alone
    bool has_rig;      ///< looks after it, and leaves it safe at the end
    bool time_passes;  ///< by itself; else between jobs nothing is due
    int wake_fd;       ///< an eventfd that tells the event loop that a job is done
    struct reply reply;
    struct surroundings surroundings;
    uint64_t progress_us;  ///< shown last
    const char *progress_what;
};

/// Who watches the rig's long calls, for rig_init: the crew that has it.
struct rig_observer crew_observer(struct crew *self);

/// Starts the thread. All fields from `rig` to `wake_fd`, and `surroundings` but for `started_us`
/// and its last three, are set before; `capacity` is 1 .. CONFIG_QUEUE_MAX. False: the system did
/// not let it.
bool crew_start(struct crew *self, size_t capacity);

/// Cancels what runs, answers what waits, leaves the rig safe and ends the thread.
void crew_stop(struct crew *self);

/// Queues a job whose state is JOB_WAITING. False: the queue is full.
bool crew_submit(struct crew *self, struct job *job);

/// Takes back a job that nobody has begun: it is the caller's again, and to be answered by it.
/// False: it is under way, or done.
bool crew_withdraw(struct crew *self, struct job *job);

/// Tells the client of a job that has waited for a while which command it waits for, once for each:
/// as progress, by `reply`, which is the caller's.
void crew_tell_wait(struct crew *self, struct job *job, struct reply *reply, uint64_t now_us);

/// How long ago the thread went on, in us.
uint64_t crew_silence_us(const struct crew *self);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// A disk writer thread for the rig's thread. A disk may take seconds for a frame, or without any
/// cause, and the bridge's watchdog fires after one second: so a thread that waits here for the
/// disk keeps serving the instrument.
///
/// Jobs run in the order in which they were queued, one at a time, so that data used only by them
/// needs no lock. One thread at a time queues jobs; jobs themselves may not.
#ifndef VERGENCE_DAEMON_SESSION_DISK_WRITER_H
#define VERGENCE_DAEMON_SESSION_DISK_WRITER_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A job that is not waited for; `work` frees it. The caller sets its size.
struct disk_writer_task {
    void (*work)(struct disk_writer_task *task);
    size_t bytes;
    struct disk_writer_task *next;  // used by the disk writer
};

/// The caller owns it: zeroed before the start, with the members before `thread` set.
struct disk_writer {
    /// Called every 50 ms by a waiting thread, unless NULL. Must not be changed by another thread.
    void (*meanwhile)(void *self);
    void *self;
    /// Limit for the total size of queued jobs.
    size_t held_max_bytes;

    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t wakeup;  // there is a job, or a stop was requested
    pthread_cond_t moved;   // a job was done
    struct disk_writer_task *first, *last;
    size_t held_bytes;
    bool started, stopping;
};

/// False: the system cannot start a thread.
bool disk_writer_start(struct disk_writer *self);

/// Runs the queued jobs, then ends the thread. Allowed if it was not started.
void disk_writer_stop(struct disk_writer *self);

/// Queues `work` and waits for it. If `self` is NULL or was not started, the caller runs it.
void disk_writer_run(struct disk_writer *self, void (*work)(void *cookie), void *cookie);

/// Queues a job without waiting for it. Blocks only while more than `held_max_bytes` are queued,
/// and then without calling `meanwhile`. Without a disk writer, the caller runs it.
void disk_writer_submit(struct disk_writer *self, struct disk_writer_task *task);

#ifdef __cplusplus
}
#endif

#endif

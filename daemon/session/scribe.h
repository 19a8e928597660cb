// SPDX-License-Identifier: Apache-2.0
/// A thread that writes to the disk for the one that has the instrument. A disk may take seconds
/// for a frame, or for nothing at all, and the bridge's watchdog bites after one: so whoever waits
/// for the disk here looks after the instrument meanwhile.
///
/// Work is done in the order in which it was given, and one piece at a time: what all of it uses
/// needs no lock. One thread at a time gives work; the work itself may not.
#ifndef VERGENCE_DAEMON_SESSION_SCRIBE_H
#define VERGENCE_DAEMON_SESSION_SCRIBE_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A piece of work that nobody waits for; `work` frees it. Whoever gives it says how large it is.
struct scribe_task {
    void (*work)(struct scribe_task *task);
    size_t bytes;
    struct scribe_task *next;  // the scribe's
};

/// The caller owns it; zeroed before the start, and what stands before `thread` set.
struct scribe {
    /// Called every 50 ms by a thread that waits, unless NULL. Not to be changed by another one.
    void (*meanwhile)(void *self);
    void *self;
    /// Of work that nobody waits for: more than that is not held.
    size_t held_max_bytes;

    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t news;   // there is work, or the end is near
    pthread_cond_t moved;  // a piece was done
    struct scribe_task *first, *last;
    size_t held_bytes;
    bool started, stopping;
};

/// False: the system does not let it have a thread.
bool scribe_start(struct scribe *self);

/// Does what was given, then ends the thread. Harmless when it was not started.
void scribe_stop(struct scribe *self);

/// Lets it be done and waits for that. NULL, or a scribe that was not started: the caller does it.
void scribe_do(struct scribe *self, void (*work)(void *cookie), void *cookie);

/// Lets it be done some time. Waits only while more than `held_max_bytes` are to be done first, and
/// then for the disk alone: nothing is called meanwhile. As above without a scribe.
void scribe_later(struct scribe *self, struct scribe_task *task);

#ifdef __cplusplus
}
#endif

#endif

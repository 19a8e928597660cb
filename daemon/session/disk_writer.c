// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/disk_writer.h"

#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/thread.h"

enum { LOOK_US = 50000 };

static bool has_thread(const struct disk_writer *self) {
    return self != NULL && self->started;
}

static void *run(void *cookie) {
    struct disk_writer *self = cookie;
    pthread_mutex_lock(&self->lock);
    for (;;) {
        while (self->first == NULL && !self->stopping) {
            pthread_cond_wait(&self->wakeup, &self->lock);
        }
        struct disk_writer_task *task = self->first;
        if (task == NULL) {
            break;
        }
        const size_t bytes = task->bytes;
        self->first = task->next;
        pthread_mutex_unlock(&self->lock);
        task->work(task);
        pthread_mutex_lock(&self->lock);
        INVARIANT(self->held_bytes >= bytes);
        self->held_bytes -= bytes;
        pthread_cond_broadcast(&self->moved);
    }
    pthread_mutex_unlock(&self->lock);
    return NULL;
}

bool disk_writer_start(struct disk_writer *self) {
    INVARIANT(!self->started);
    pthread_condattr_t attributes;
    if (pthread_mutex_init(&self->lock, NULL) != 0 || pthread_condattr_init(&attributes) != 0) {
        return false;
    }
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    self->started = pthread_cond_init(&self->wakeup, NULL) == 0 &&
                    pthread_cond_init(&self->moved, &attributes) == 0 &&
                    thread_start(&self->thread, run, self);
    pthread_condattr_destroy(&attributes);
    return self->started;
}

void disk_writer_stop(struct disk_writer *self) {
    if (!self->started) {
        return;
    }
    pthread_mutex_lock(&self->lock);
    self->stopping = true;
    pthread_cond_signal(&self->wakeup);
    pthread_mutex_unlock(&self->lock);
    pthread_join(self->thread, NULL);
    INVARIANT(self->first == NULL && self->held_bytes == 0);
    self->started = false;
    pthread_cond_destroy(&self->wakeup);
    pthread_cond_destroy(&self->moved);
    pthread_mutex_destroy(&self->lock);
}

/// With the lock held.
static void append(struct disk_writer *self, struct disk_writer_task *task) {
    task->next = NULL;
    if (self->first == NULL) {
        self->first = task;
    } else {
        self->last->next = task;
    }
    self->last = task;
    self->held_bytes += task->bytes;
    pthread_cond_signal(&self->wakeup);
}

void disk_writer_submit(struct disk_writer *self, struct disk_writer_task *task) {
    if (!has_thread(self)) {
        task->work(task);
        return;
    }
    INVARIANT(pthread_equal(self->thread, pthread_self()) == 0);
    pthread_mutex_lock(&self->lock);
    while (self->held_bytes > self->held_max_bytes) {
        pthread_cond_wait(&self->moved, &self->lock);
    }
    append(self, task);
    pthread_mutex_unlock(&self->lock);
}

/// A job that its caller waits for.
struct write_job {
    struct disk_writer_task task;
    struct disk_writer *disk_writer;
    void (*work)(void *cookie);
    void *cookie;
    bool done;
};

static void run_write_job(struct disk_writer_task *task) {
    // The job is its first member.
    struct write_job *write_job = (struct write_job *)task;
    write_job->work(write_job->cookie);
    pthread_mutex_lock(&write_job->disk_writer->lock);
    write_job->done = true;
    pthread_mutex_unlock(&write_job->disk_writer->lock);
}

void disk_writer_run(struct disk_writer *self, void (*work)(void *cookie), void *cookie) {
    if (!has_thread(self)) {
        work(cookie);
        return;
    }
    INVARIANT(pthread_equal(self->thread, pthread_self()) == 0);
    struct write_job write_job = {
        .task = {.work = run_write_job}, .disk_writer = self, .work = work, .cookie = cookie};
    pthread_mutex_lock(&self->lock);
    append(self, &write_job.task);
    uint64_t look_us = monotonic_now_us() + LOOK_US;
    while (!write_job.done) {
        const struct timespec until = monotonic_timespec(look_us);
        pthread_cond_timedwait(&self->moved, &self->lock, &until);
        const uint64_t now_us = monotonic_now_us();
        if (!write_job.done && now_us >= look_us) {
            pthread_mutex_unlock(&self->lock);
            if (self->meanwhile != NULL) {
                self->meanwhile(self->self);
            }
            look_us = now_us + LOOK_US;
            pthread_mutex_lock(&self->lock);
        }
    }
    pthread_mutex_unlock(&self->lock);
}

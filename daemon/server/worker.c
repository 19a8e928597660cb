// SPDX-License-Identifier: Apache-2.0

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/thread.h"
#include "daemon/server/daemon.h"

enum { IDLE_US = 50000, PROGRESS_US = 100000, WAIT_REPORTED_US = 500000 };

bool worker_should_stop(struct worker *self) {
    atomic_store(&self->alive_us, monotonic_now_us());
    const struct job *job = self->running;
    return atomic_load(&self->stopping) || (job != NULL && atomic_load(&job->cancelled));
}

/// Called by the rig, which ends its command on true; the recording must contain that.
static bool rig_should_stop(void *cookie) {
    struct worker *self = cookie;
    const bool stop = worker_should_stop(self);
    if (stop && self->running != NULL) {
        record_cancel(&self->daemon->record);
    }
    return stop;
}

void worker_progress(struct worker *self, const char *what, uint32_t done, uint32_t total) {
    const uint64_t now_us = monotonic_now_us();
    atomic_store(&self->alive_us, now_us);
    if (self->running == NULL ||
        (what == self->progress_what && now_us - self->progress_us < PROGRESS_US)) {
        return;
    }
    self->progress_us = now_us;
    self->progress_what = what;
    reply_progress(&self->reply, what, done, total);
}

void worker_send(struct worker *self, const void *data, size_t bytes) {
    const char *from = data;
    while (bytes > 0) {
        const size_t part = bytes < REPLY_BYTES_MAX ? bytes : REPLY_BYTES_MAX;
        while (!output_await(self->running->output)) {
            if (worker_should_stop(self)) {
                return;
            }
        }
        reply_bytes(&self->reply, from, part);
        from += part;
        bytes -= part;
    }
}

static void rig_progress(void *cookie, const char *what, uint32_t done, uint32_t total) {
    worker_progress(cookie, what, done, total);
}

struct rig_observer worker_observer(struct worker *self) {
    return (struct rig_observer){
        .should_stop = rig_should_stop, .progress = rig_progress, .self = self};
}

/// Returns a job to the event loop.
static void finish(struct worker *self, struct job *job) {
    const uint64_t one = 1;
    pthread_mutex_lock(&self->lock);
    INVARIANT(self->running == job && atomic_load(&job->state) == JOB_WAITING);
    self->running = NULL;
    pthread_mutex_unlock(&self->lock);
    atomic_store(&job->state, JOB_DONE);
    const ssize_t reported = write(self->wake_fd, &one, sizeof one);
    (void)reported;  // fails only if enough wake-ups are already pending
}

// ---- logging

enum { REPORTED_LINE_BYTES = 60 };

/// Whether the error is a fault of the instrument or the machine, and not of the input.
static bool is_fault(const struct worker *self, int error) {
    switch (error) {
        case ERROR_I2C_NACK:
        case ERROR_I2C_ARBITRATION:
        case ERROR_I2C_STUCK:
        case ERROR_TIMEOUT:
        case ERROR_DEVICE:
        case ERROR_VERIFY:
        case ERROR_RESTARTED:
        case ERROR_IO:
        case ERROR_FULL:
        case ERROR_JAMMED:
        case ERROR_FRAME:
        case ERROR_MEMORY:
            return true;
        default:
            // Without the rig it is a file that clients may not use.
            return error == ERROR_REFUSED && self->has_rig;
    }
}

/// Logs a change of the instrument's state and its cause; for an error, with its message.
static bool report_state(struct worker *self, const char *line, int error, const char *message) {
    static const char *const states[] = {
        [RIG_DOWN] = "down", [RIG_READY] = "ready", [RIG_SAFE] = "in its safe state"};
    if (!self->has_rig || self->daemon->rig.state == self->reported_state) {
        return false;
    }
    self->reported_state = self->daemon->rig.state;
    const bool worked = error == ERROR_OK;
    log_ring_print(&self->daemon->log_ring,
                   worked || error == ERROR_CANCELLED ? HAL_LOG_NOTICE : HAL_LOG_ERROR,
                   "the instrument is %s: %.*s%s%s%s%s", states[self->reported_state],
                   (int)REPORTED_LINE_BYTES, line, worked ? "" : ": ERR ",
                   worked ? "" : error_name(error), worked ? "" : " ", worked ? "" : message);
    return true;
}

/// Logs that a recording was cut off, as soon as it is known.
static void report_cut(struct worker *self) {
    const char *cut = self->has_rig ? record_cut(&self->daemon->record) : NULL;
    if (cut != NULL && !self->cut_reported) {
        log_ring_print(&self->daemon->log_ring, HAL_LOG_ERROR, "the recording is cut off: %s", cut);
    }
    self->cut_reported = cut != NULL;
}

/// Logs the outcome of a command if it matters later.
static void report_outcome(struct worker *self, const char *line, int error, const char *message) {
    report_cut(self);
    if (!report_state(self, line, error, message) && is_fault(self, error)) {
        log_ring_print(&self->daemon->log_ring, HAL_LOG_ERROR, "%.*s: ERR %s %s",
                       (int)REPORTED_LINE_BYTES, line, error_name(error), message);
    }
}

/// Adds advice to a disk-full error.
static void advise(const struct worker *self, int error, char *message, size_t bytes) {
    const size_t length = strlen(message);
    const bool cut = self->has_rig && record_cut(&self->daemon->record) != NULL;
    if (error == ERROR_FULL) {
        snprintf(message + length, bytes - length, "%s",
                 cut ? "; the recording is cut off: \"record stop\", free space (\"remove NAME\"), "
                       "record again"
                     : "; free space (\"remove NAME\") and try again");
    }
}

struct daemon_axes daemon_axes_of(const struct rig *rig) {
    struct daemon_axes axes;
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct rig_camera *camera = &rig->camera[side];
        axes.at[side][0] = camera->pan_q4;
        axes.at[side][1] = camera->lens.commanded[LENS_ZOOM];
        axes.at[side][2] = camera->lens.commanded[LENS_FOCUS];
    }
    return axes;
}

static int run_command(struct worker *self, const struct job *job,
                       const struct command_call *call) {
    struct daemon *daemon = self->daemon;
    if (!self->has_rig) {
        return record_run(&daemon->record, job->command, call, job->line);
    }
    const struct daemon_axes before = daemon_axes_of(&daemon->rig);
    const int error = record_run(&daemon->record, job->command, call, job->line);
    const struct daemon_axes after = daemon_axes_of(&daemon->rig);
    if (memcmp(&before, &after, sizeof before) != 0) {
        atomic_fetch_add(&daemon->health.moves, 1);
    }
    return error;
}

static void run(struct worker *self, struct job *job) {
    INVARIANT(job->worker == self && job->command != NULL);
    char message[JOB_MESSAGE_BYTES] = "";
    const struct command_call call = {
        .rig = &self->daemon->rig,
        .values = job->values,
        .line = job->line,
        .reply = &self->reply.items,
        .message = message,
        .message_bytes = sizeof message,
        .table = self->daemon->table,
        .context = self->daemon,
        .job = job,
    };
    const struct reply_sink sink = output_sink(job->output);
    reply_begin(&self->reply, &sink, &job->request, job->terminal);
    self->reply.bar_columns = job->bar_columns;
    self->progress_what = NULL;
    int error = ERROR_CANCELLED;
    if (!atomic_load(&self->stopping) && !atomic_load(&job->cancelled)) {
        error = run_command(self, job, &call);
    }
    if (error == ERROR_CANCELLED && message[0] == '\0') {
        strcpy(message, error_text(error));
    }
    advise(self, error, message, sizeof message);
    report_outcome(self, job->line, error, message);
    // A watch is answered by its last round, or by what ends it.
    if (error == ERROR_OK && job->watch.on && !(job->round && job->watch.rounds_left == 1)) {
        if (job->round) {
            job->watch.rounds_left -= job->watch.rounds_left > 0;
            reply_end_round(&self->reply);
        }
    } else {
        job->watch.on = false;
        reply_end(&self->reply, error, message);
    }
}

/// Services the rig: between two jobs, and while one waits for the disk.
static void look_after_rig(void *cookie) {
    struct worker *self = cookie;
    struct daemon *daemon = self->daemon;
    const int error = self->has_rig ? record_idle(&daemon->record, &daemon->rig) : 0;
    if (error != ERROR_OK) {
        report_outcome(self, "between commands", error, self->daemon->rig.last_error.text);
    }
}

static void idle(struct worker *self) {
    atomic_store(&self->alive_us, monotonic_now_us());
    look_after_rig(self);
    report_cut(self);
}

/// Waits for the next job; NULL after a while without one.
static struct job *next_job(struct worker *self) {
    const struct timespec until = monotonic_timespec(monotonic_now_us() + IDLE_US);
    struct job *job = NULL;
    pthread_mutex_lock(&self->lock);
    int waited = 0;
    while (self->count == 0 && !atomic_load(&self->stopping) && waited == 0) {
        waited = pthread_cond_timedwait(&self->wakeup, &self->lock, &until);
    }
    if (self->count > 0) {
        job = self->waiting[self->first];
        self->first = (self->first + 1) % CONFIG_QUEUE_MAX;
        self->count--;
        INVARIANT(job != NULL && self->running == NULL);
        self->running = job;
    }
    pthread_mutex_unlock(&self->lock);
    return job;
}

static void *work(void *cookie) {
    struct worker *self = cookie;
    uint64_t idle_us = 0;
    for (;;) {
        struct job *job = next_job(self);
        if (job == NULL && atomic_load(&self->stopping)) {
            break;
        }
        if (job != NULL) {
            look_after_rig(self);
            run(self, job);
            finish(self, job);
        }
        // Also if jobs follow each other without a pause.
        const uint64_t now_us = monotonic_now_us();
        if (now_us - idle_us >= IDLE_US) {
            idle_us = now_us;
            idle(self);
        }
    }
    if (self->has_rig && self->daemon->rig.state != RIG_DOWN) {
        record_command(&self->daemon->record, "safe");
        rig_safe(&self->daemon->rig);
        record_command_end(&self->daemon->record, 0);
        report_state(self, "the service ends", 0, "");
    }
    return NULL;
}

bool worker_start(struct worker *self, struct daemon *daemon, int wake_fd, size_t capacity) {
    INVARIANT(capacity >= 1 && capacity <= CONFIG_QUEUE_MAX);
    pthread_condattr_t attributes;
    self->capacity = capacity;
    self->daemon = daemon;
    self->has_rig = self == &daemon->rig_worker;
    self->wake_fd = wake_fd;
    if (self->has_rig) {
        // A hanging disk counts as a stuck thread: alive_us stays.
        daemon->disk_writer.meanwhile = look_after_rig;
        daemon->disk_writer.self = self;
    }
    atomic_store(&self->alive_us, monotonic_now_us());
    reply_init(&self->reply);
    if (pthread_mutex_init(&self->lock, NULL) != 0 || pthread_condattr_init(&attributes) != 0) {
        return false;
    }
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    self->started = pthread_cond_init(&self->wakeup, &attributes) == 0 &&
                    thread_start(&self->thread, work, self);
    pthread_condattr_destroy(&attributes);
    return self->started;
}

void worker_stop(struct worker *self) {
    if (!self->started) {
        return;
    }
    pthread_mutex_lock(&self->lock);
    atomic_store(&self->stopping, true);
    pthread_cond_signal(&self->wakeup);
    pthread_mutex_unlock(&self->lock);
    pthread_join(self->thread, NULL);
    INVARIANT(self->count == 0 && self->running == NULL);
    self->started = false;
    if (self->has_rig) {
        self->daemon->disk_writer.meanwhile = NULL;
    }
    pthread_cond_destroy(&self->wakeup);
    pthread_mutex_destroy(&self->lock);
}

void worker_cancel(struct worker *self) {
    pthread_mutex_lock(&self->lock);
    if (self->running != NULL) {
        atomic_store(&self->running->cancelled, true);
    }
    pthread_mutex_unlock(&self->lock);
}

bool worker_submit(struct worker *self, struct job *job) {
    INVARIANT(atomic_load(&job->state) == JOB_WAITING);
    pthread_mutex_lock(&self->lock);
    INVARIANT(self->count <= self->capacity && self->first < CONFIG_QUEUE_MAX);
    const bool fits = self->count < self->capacity;
    if (fits) {
        job->worker = self;
        job->queued_us = monotonic_now_us();
        job->ahead = (uint32_t)self->count + (self->running != NULL);
        job->ahead_shown = JOB_NOT_SHOWN;
        job->bar_columns = 0;
        self->waiting[(self->first + self->count) % CONFIG_QUEUE_MAX] = job;
        self->count++;
        pthread_cond_signal(&self->wakeup);
    }
    pthread_mutex_unlock(&self->lock);
    return fits;
}

/// Number of jobs queued before a job; `count` if it is not queued. The caller holds the lock.
static size_t place_of(const struct worker *self, const struct job *job) {
    size_t place = 0;
    INVARIANT(self->count <= self->capacity);
    while (place < self->count && self->waiting[(self->first + place) % CONFIG_QUEUE_MAX] != job) {
        place++;
    }
    return place;
}

bool worker_withdraw(struct worker *self, struct job *job) {
    pthread_mutex_lock(&self->lock);
    const size_t place = place_of(self, job);
    const bool waits = place < self->count;
    for (size_t i = place; waits && i + 1 < self->count; i++) {
        self->waiting[(self->first + i) % CONFIG_QUEUE_MAX] =
            self->waiting[(self->first + i + 1) % CONFIG_QUEUE_MAX];
    }
    self->count -= waits;
    pthread_mutex_unlock(&self->lock);
    return waits;
}

void worker_report_wait(struct worker *self, struct job *job, struct reply *reply,
                        uint64_t now_us) {
    char what[COMMAND_LINE_MAX];
    // Under the lock the thread cannot start a job whose answer this would interleave with.
    pthread_mutex_lock(&self->lock);
    const size_t place = place_of(self, job);
    const uint32_t ahead = (uint32_t)place + 1;
    if (place < self->count && self->running != NULL && ahead != job->ahead_shown &&
        now_us > job->queued_us + WAIT_REPORTED_US) {
        job->ahead = ahead > job->ahead ? ahead : job->ahead;
        job->ahead_shown = ahead;
        snprintf(what, sizeof what, REPLY_WAITING "%s", self->running->command->name);
        const struct reply_sink sink = output_sink(job->output);
        reply_begin(reply, &sink, &job->request, job->terminal);
        reply_progress(reply, what, job->ahead - ahead, job->ahead);
        job->bar_columns = reply->bar_columns;
    }
    pthread_mutex_unlock(&self->lock);
}

uint64_t worker_silence_us(const struct worker *self) {
    const uint64_t now_us = monotonic_now_us();
    const uint64_t alive_us = atomic_load(&self->alive_us);
    return now_us > alive_us ? now_us - alive_us : 0;
}

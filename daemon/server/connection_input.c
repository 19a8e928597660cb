// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/connection_input.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/server/server.h"

bool connection_is_edited(const struct connection *self) {
    return self->kind == CONNECTION_TERMINAL && !self->program;
}

bool connection_is_busy(const struct connection *self) {
    return atomic_load(&self->job.state) != JOB_FREE || self->job.watch.on;
}

enum {
    CTRL_C = 3,
    BELL = 7,
    TIMEOUT_US = 1000000,     ///< for a command that may be a long one
    LOOK_BYTES = 256 * 1024,  ///< more than a socket buffers
    LOOK_US = 200000,         ///< between two looks for a Ctrl-C
    QUIET_US = 300000         ///< after which pasted input has ended
};

size_t connection_input_room(const struct connection *self) {
    if (!self->used || self->ended || self->gone) {
        return 0;
    }
    // Short commands free the buffer soon: pasted input may wait for them.
    const bool listens = self->kind == CONNECTION_TERMINAL && connection_is_busy(self) &&
                         (self->overflowed || monotonic_now_us() - self->last_rx_us > TIMEOUT_US);
    return self->overflowed || (listens && self->input_bytes == sizeof self->input)
               ? sizeof self->input
               : sizeof self->input - self->input_bytes;
}

bool connection_input_is_overflowing(const struct connection *self) {
    return self->overflowed && monotonic_now_us() - self->last_rx_us <= QUIET_US;
}

bool connection_input_is_paused(const struct connection *self) {
    return self->used && !self->ended && !self->gone && connection_is_busy(self) &&
           connection_input_room(self) == 0;
}

bool connection_input_is_line_end(char byte) {
    return byte == '\n' || byte == '\r';
}

/// Discards what a person typed ahead. A program counts answers: its lines are not run, but each is
/// answered.
static void refuse_ahead(struct connection *self) {
    size_t length = connection_is_edited(self) || self->gone ? 0 : self->input_bytes;
    while (length > 0 && !connection_input_is_line_end(self->input[length - 1])) {
        length--;
    }
    self->input_bytes = length;
    self->refused_bytes = length;
    self->skipping = self->skipping && length > 0;
    self->dropped_lines -= self->dropping && self->dropped_lines > 0;
    self->dropping = false;
    if (connection_is_edited(self)) {
        self->overflowed = false;
        self->dropped_lines = 0;
    }
}

/// A job that waits for another client's is answered here, as the other may take long.
static void cancel_job(struct connection *self) {
    struct job *job = &self->job;
    if (!connection_is_busy(self)) {
        return;
    }
    atomic_store(&job->cancelled, true);
    if (atomic_load(&job->state) == JOB_WAITING && worker_withdraw(job->worker, job)) {
        job->watch.on = false;
        server_answer(self->server, job, ERROR_CANCELLED, error_text(ERROR_CANCELLED));
        atomic_store(&job->state, JOB_DONE);
    }
}

/// Ctrl-C: cancels what runs, discards what was sent ahead.
void connection_input_cancel(struct connection *self) {
    self->ctrl_c_ahead = false;
    refuse_ahead(self);
    cancel_job(self);
}

/// Drops a byte. A line is dropped whole and counts once.
static void drop(struct connection *self, char byte) {
    self->dropped_lines += !connection_input_is_line_end(byte) && !self->dropping;
    self->dropping = !connection_input_is_line_end(byte);
}

/// The buffer is full: drops all further input, including the line that is cut. A person's
/// typed-ahead input is dropped entirely, since later lines may depend on earlier ones.
static void overflow(struct connection *self) {
    size_t length = connection_is_edited(self) ? 0 : self->input_bytes;
    while (length > 0 && !connection_input_is_line_end(self->input[length - 1])) {
        length--;
    }
    self->overflowed = true;
    self->dropping = self->skipping && length == 0;  // that line has already been answered
    for (size_t i = length; i < self->input_bytes; i++) {
        drop(self, self->input[i]);
    }
    self->input_bytes = length;
    self->refused_bytes = self->refused_bytes < length ? self->refused_bytes : length;
    if (connection_is_edited(self)) {
        const char bell = BELL;
        output_put(&self->output, &bell, 1);
    }
}

void connection_input_receive(struct connection *self, const char *data, size_t bytes, bool end) {
    for (size_t i = 0; i < bytes; i++) {
        if (data[i] == CTRL_C && (connection_is_busy(self) || !connection_is_edited(self))) {
            if (connection_is_edited(self)) {
                output_put_text(&self->output, "^C\r\n");
            }
            connection_input_cancel(self);
            continue;
        }
        if (!self->overflowed && self->input_bytes == sizeof self->input) {
            overflow(self);
        }
        if (self->overflowed) {
            drop(self, data[i]);
        } else {
            self->input[self->input_bytes++] = data[i];
        }
    }
    self->last_rx_us = monotonic_now_us();
    self->ended = self->ended || end;
}

void connection_input_peek(struct connection *self, const char *data, size_t bytes) {
    if (!self->ctrl_c_ahead && memchr(data, CTRL_C, bytes) != NULL) {
        self->ctrl_c_ahead = true;
        cancel_job(self);
    }
}

void connection_input_end_overflow(struct connection *self) {
    self->overflowed = false;
    self->skipping = self->dropping;
    self->dropping = false;
    self->dropped_lines = 0;
}

void connection_input_forget(struct connection *self, size_t bytes) {
    INVARIANT(bytes <= self->input_bytes);
    memmove(self->input, self->input + bytes, self->input_bytes - bytes);
    self->input_bytes -= bytes;
    self->refused_bytes -= bytes < self->refused_bytes ? bytes : self->refused_bytes;
}

static void receive(struct connection *self) {
    char data[CONNECTION_INPUT_BYTES];
    const size_t room = connection_input_room(self);
    INVARIANT(room > 0 && room <= sizeof data);
    const ssize_t bytes = read(self->in_fd, data, room);
    if (bytes > 0) {
        connection_input_receive(self, data, (size_t)bytes, false);
    } else if (bytes == 0) {
        connection_input_receive(self, NULL, 0, true);
    } else if (errno != EAGAIN && errno != EINTR) {
        connection_gone(self);
    }
}

/// A Ctrl-C may be pending behind what a client has sent ahead. On a pipe it cannot be seen.
static void peek(struct connection *self) {
    char data[LOOK_BYTES];
    const ssize_t bytes = recv(self->in_fd, data, sizeof data, MSG_PEEK | MSG_DONTWAIT);
    if (bytes > 0) {
        connection_input_peek(self, data, (size_t)bytes);
    }
}

void connection_input_take(struct connection *self, short input, uint64_t now_us) {
    if (connection_input_is_paused(self) && now_us - self->looked_us >= LOOK_US) {
        self->looked_us = now_us;
        peek(self);
    }
    if ((input & POLLIN) != 0 && connection_input_room(self) > 0) {
        receive(self);
        return;
    }
    if ((input & (POLLHUP | POLLERR | POLLNVAL)) == 0 || (input & POLLIN) != 0) {
        return;
    }
    // Both directions are closed; of a pipe with a separate output only this one.
    if (self->in_fd == self->out_fd) {
        connection_gone(self);
    } else {
        connection_input_receive(self, NULL, 0, true);
    }
}

void connection_gone(struct connection *self) {
    self->gone = true;
    self->ended = true;
    output_reset(&self->output, true);
    connection_input_cancel(self);
    if (atomic_load(&self->job.state) == JOB_FREE) {
        self->job.watch.on = false;
    }
}

// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/connection.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"

enum { CTRL_C = 3, SEND_BYTES = 4096, BACKLOG_BYTES = OUTPUT_BYTES / 4 };

static const char prompt[] = "vergence> ";

static void send_to_terminal(void *cookie, const char *data, size_t bytes) {
    struct connection *self = cookie;
    output_put(&self->output, data, bytes);
}

static void complete(void *cookie, const char *typed, char *words) {
    struct connection *self = cookie;
    self->host->complete(self->host->self, typed, words);
}

bool connection_init(struct connection *self, const struct connection_host *host, int wake_fd) {
    memset(self, 0, sizeof *self);
    self->host = host;
    self->in_fd = -1;
    self->out_fd = -1;
    self->job.output = &self->output;
    return output_open(&self->output, wake_fd);
}

void connection_destroy(struct connection *self) {
    output_close(&self->output);
}

/// A person types there now.
static bool is_edited(const struct connection *self) {
    return self->kind == CONNECTION_TERMINAL && !self->program;
}

void connection_begin(struct connection *self, enum connection_kind kind, int in_fd, int out_fd,
                      const char *name) {
    INVARIANT(!self->used && atomic_load(&self->job.state) == JOB_FREE);
    self->used = true;
    self->kind = kind;
    self->program = false;
    self->in_fd = in_fd;
    self->out_fd = out_fd;
    snprintf(self->name, sizeof self->name, "%s", name);
    self->json = false;
    self->progress = false;
    self->ended = false;
    self->gone = false;
    self->input_bytes = 0;
    self->refused_bytes = 0;
    self->skipping = false;
    self->stalled_us = 0;
    self->job.watch.on = false;
    self->job.quit = false;
    output_reset(&self->output, false);
    if (kind == CONNECTION_TERMINAL) {
        editor_init(&self->editor, send_to_terminal, complete, self, prompt);
        output_put_text(&self->output, "vergence: \"help\" lists the commands\r\n");
        editor_begin(&self->editor);
    }
}

/// Whether a command is under way, or a watch.
static bool is_busy(const struct connection *self) {
    return atomic_load(&self->job.state) != JOB_FREE || self->job.watch.on;
}

bool connection_wants_input(const struct connection *self) {
    return self->used && !self->ended && !self->gone && self->input_bytes < sizeof self->input;
}

/// What a person has typed ahead is forgotten. A program counts answers: none of its lines is
/// carried out, and each is answered.
static void refuse_ahead(struct connection *self) {
    size_t length = is_edited(self) || self->gone ? 0 : self->input_bytes;
    while (length > 0 && self->input[length - 1] != '\n' && self->input[length - 1] != '\r') {
        length--;
    }
    self->input_bytes = length;
    self->refused_bytes = length;
    self->skipping = self->skipping && length > 0;
}

/// Ctrl-C: what runs is cancelled, what was sent ahead is not begun. What only waits for others' is
/// answered here: they may take long.
static void cancel(struct connection *self) {
    struct job *job = &self->job;
    refuse_ahead(self);
    if (!is_busy(self)) {
        return;
    }
    atomic_store(&job->cancelled, true);
    if (atomic_load(&job->state) == JOB_WAITING && self->host->withdraw(self->host->self, job)) {
        job->watch.on = false;
        self->host->answer(self->host->self, job, ERROR_CANCELLED, error_text(ERROR_CANCELLED));
        atomic_store(&job->state, JOB_DONE);
    }
}

void connection_receive(struct connection *self, const char *data, size_t bytes, bool end) {
    for (size_t i = 0; i < bytes; i++) {
        if (data[i] == CTRL_C && (is_busy(self) || !is_edited(self))) {
            if (is_edited(self)) {
                output_put_text(&self->output, "^C\r\n");
            }
            cancel(self);
        } else if (self->input_bytes < sizeof self->input) {
            // A person who types ahead further than this has lost the thread anyway.
            self->input[self->input_bytes++] = data[i];
        }
    }
    self->ended = self->ended || end;
}

void connection_gone(struct connection *self) {
    self->gone = true;
    self->ended = true;
    output_reset(&self->output, true);
    cancel(self);
    if (atomic_load(&self->job.state) == JOB_FREE) {
        self->job.watch.on = false;
    }
}

/// Makes a job of a line and hands it over; a refused one is only answered.
static void begin_line(struct connection *self, const char *line, bool refused) {
    struct job *job = &self->job;
    char message[JOB_MESSAGE_BYTES];
    INVARIANT(atomic_load(&job->state) == JOB_FREE);
    job->terminal = is_edited(self);
    job->request = (struct request){.json = self->json, .progress = self->progress};
    job->round = false;
    atomic_store(&job->cancelled, false);
    int error = request_parse(line, &job->request, message, sizeof message);
    const char *command = job->request.command;
    if (error == 0 && line[0] == '@' && command[strspn(command, " \t")] == '\0') {
        self->json = job->request.json;
        self->progress = job->request.progress;
        job->command = NULL;
        self->host->answer(self->host->self, job, 0, "");
        return;
    }
    job->command = NULL;
    if (error == 0) {
        error = self->host->parse(self->host->self, command, job, message, sizeof message);
    }
    if (error == 0 && job->command != NULL && refused) {
        error = ERROR_CANCELLED;
        snprintf(message, sizeof message, "%s", error_text(error));
    }
    if (error != 0) {
        self->host->answer(self->host->self, job, error, message);
    } else if (job->command != NULL) {
        atomic_store(&job->state, JOB_WAITING);
        self->host->submit(self->host->self, job);
    }
}

/// A terminal's lines that are none for the commands: who is at its other end.
static bool change_side(struct connection *self, const char *line) {
    const bool program = strcmp(line, "@program") == 0;
    if (self->kind != CONNECTION_TERMINAL || (!program && strcmp(line, "@terminal") != 0)) {
        return false;
    }
    self->program = program;
    self->json = false;
    self->progress = false;
    output_put_text(&self->output, "OK\r\n");
    return true;
}

static void forget_input(struct connection *self, size_t bytes) {
    INVARIANT(bytes <= self->input_bytes);
    memmove(self->input, self->input + bytes, self->input_bytes - bytes);
    self->input_bytes -= bytes;
    self->refused_bytes -= bytes < self->refused_bytes ? bytes : self->refused_bytes;
}

/// Feeds the editor until it has a line, or has shown more than is read at once: one key may show
/// the whole line anew.
static void step_terminal(struct connection *self) {
    size_t used = 0;
    while (used < self->input_bytes && !is_busy(self) && is_edited(self) && !self->ended &&
           output_length(&self->output) <= BACKLOG_BYTES) {
        const enum editor_event event = editor_feed(&self->editor, self->input[used++]);
        if (event == EDITOR_END) {
            output_put_text(&self->output, "\r\n");
            self->ended = true;
        } else if (event == EDITOR_LINE && !change_side(self, self->editor.line)) {
            begin_line(self, self->editor.line, false);
        }
        if (event != EDITOR_MORE && event != EDITOR_END && !is_busy(self) && is_edited(self)) {
            editor_begin(&self->editor);
        }
    }
    forget_input(self, used);
}

/// Takes the next whole line of a program; false: there is none.
static bool step_lines(struct connection *self) {
    size_t length = 0;
    while (length < self->input_bytes && self->input[length] != '\n' &&
           self->input[length] != '\r') {
        length++;
    }
    // The last line may lack its end.
    const bool whole = length < self->input_bytes || (self->ended && length > 0);
    if (!whole && length < JOB_LINE_BYTES) {
        return false;
    }
    char line[JOB_LINE_BYTES];
    const bool fits = length < sizeof line && memchr(self->input, '\0', length) == NULL;
    memcpy(line, self->input, fits ? length : 0);
    line[fits ? length : 0] = '\0';
    const bool skipped = self->skipping;
    const bool refused = self->refused_bytes > 0;
    self->skipping = !whole;
    forget_input(self, whole && length < self->input_bytes ? length + 1 : length);
    if (skipped || change_side(self, line)) {
        return true;
    }
    if (fits) {
        begin_line(self, line, refused);
    } else {
        self->job.request = (struct request){.json = self->json, .id = REQUEST_ID_NONE};
        self->job.terminal = false;
        self->host->answer(self->host->self, &self->job, ERROR_SYNTAX,
                           length < sizeof line ? "the line holds a control character"
                                                : "the line is longer than 512 characters");
    }
    return true;
}

/// A command has been answered.
static void take_answer(struct connection *self, uint64_t now_us) {
    struct job *job = &self->job;
    job->bar_shown = false;
    atomic_store(&job->state, JOB_FREE);
    if (job->quit) {
        job->quit = false;
        self->ended = true;
        forget_input(self, self->input_bytes);
    }
    if (job->watch.on && !self->gone) {
        // The rounds stay on their beat, and none is made up for.
        const uint64_t beat_us = self->watch_us + job->watch.interval_us;
        self->watch_us = !job->round ? now_us : beat_us > now_us ? beat_us : now_us;
        return;
    }
    job->watch.on = false;
    if (is_edited(self) && !self->ended) {
        editor_begin(&self->editor);
    }
}

/// The next round of a watch, or its end.
static void step_watch(struct connection *self, uint64_t now_us) {
    struct job *job = &self->job;
    char message[JOB_MESSAGE_BYTES];
    const bool cancelled = atomic_load(&job->cancelled);
    if (!cancelled && now_us < self->watch_us) {
        return;
    }
    if (cancelled) {
        self->host->answer(self->host->self, job, ERROR_CANCELLED, error_text(ERROR_CANCELLED));
    } else {
        job->round = true;
        const int error =
            self->host->parse(self->host->self, job->watch.line, job, message, sizeof message);
        INVARIANT(error == 0 && job->command != NULL);
        atomic_store(&job->state, JOB_WAITING);
        self->host->submit(self->host->self, job);
    }
    // Answered already: cancelled, or too much else waits.
    if (atomic_load(&job->state) == JOB_FREE) {
        job->watch.on = false;
        if (is_edited(self) && !self->ended) {
            editor_begin(&self->editor);
        }
    }
}

void connection_step(struct connection *self, uint64_t now_us) {
    if (atomic_load(&self->job.state) == JOB_DONE) {
        take_answer(self, now_us);
    }
    // Who does not read his answers gets no more of them.
    if (self->gone || atomic_load(&self->job.state) != JOB_FREE ||
        output_length(&self->output) > BACKLOG_BYTES) {
        return;
    }
    if (self->job.watch.on) {
        step_watch(self, now_us);
        return;
    }
    if (is_edited(self)) {
        step_terminal(self);
    }
    while (!is_edited(self) && !is_busy(self) && self->input_bytes > 0 &&
           output_length(&self->output) <= BACKLOG_BYTES && step_lines(self)) {
    }
}

uint64_t connection_due_us(const struct connection *self) {
    const bool waits = atomic_load(&self->job.state) == JOB_FREE && self->job.watch.on;
    return self->used && waits ? self->watch_us : UINT64_MAX;
}

void connection_send(struct connection *self, uint64_t now_us) {
    char data[SEND_BYTES];
    for (;;) {
        const size_t bytes = output_peek(&self->output, data, sizeof data);
        if (bytes == 0) {
            self->stalled_us = 0;
            return;
        }
        const ssize_t sent = write(self->out_fd, data, bytes);
        if (sent < 0 && errno == EINTR) {
            continue;
        }
        if (sent < 0 && errno != EAGAIN) {
            connection_gone(self);
            return;
        }
        if (sent <= 0) {
            self->stalled_us = self->stalled_us != 0 ? self->stalled_us : now_us;
            return;
        }
        self->stalled_us = 0;
        output_take(&self->output, (size_t)sent);
    }
}

bool connection_over(struct connection *self) {
    if (!self->used || is_busy(self)) {
        return false;
    }
    return self->gone || (self->ended && (self->input_bytes == 0 || is_edited(self)) &&
                          output_length(&self->output) == 0);
}

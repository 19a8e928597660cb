// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/connection.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "console/line/completion.h"
#include "console/line/framing.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/token.h"
#include "daemon/server/listener.h"

enum { CTRL_C = 3, SEND_BYTES = 4096, LIFE_US = 1000 * FRAMING_IDLE_MS };

static const char prompt[] = "vergence> ";

static void send_to_terminal(void *cookie, const char *data, size_t bytes) {
    struct connection *self = cookie;
    output_put(&self->output, data, bytes);
}

static void complete(void *cookie, const char *typed, char *words) {
    const struct connection *self = cookie;
    const struct daemon *daemon = self->dispatch->daemon;
    // Uses only what never changes: the workers run in other threads.
    completion_words(&daemon->table, daemon, typed, words, EDITOR_WORDS_BYTES);
}

bool connection_init(struct connection *self, struct dispatch *dispatch, int wake_fd) {
    memset(self, 0, sizeof *self);
    self->dispatch = dispatch;
    self->in_fd = -1;
    self->out_fd = -1;
    self->job.output = &self->output;
    return output_open(&self->output, wake_fd);
}

void connection_begin(struct connection *self, bool terminal, int in_fd, int out_fd) {
    INVARIANT(!self->used && atomic_load(&self->job.state) == JOB_FREE);
    INVARIANT(in_fd >= 0 && out_fd >= 0);
    self->used = true;
    self->greeted = true;
    self->token = NULL;
    self->hangs_up = NULL;
    self->terminal = terminal;
    self->program = false;
    self->framed = false;
    self->in_fd = in_fd;
    self->out_fd = out_fd;
    self->json = false;
    self->progress = false;
    self->ended = false;
    self->gone = false;
    self->input_bytes = 0;
    self->skipping = false;
    self->stalled_us = 0;
    self->job.watch.on = false;
    self->job.quit = false;
    output_reset(&self->output, false);
    if (terminal) {
        editor_init(&self->editor, send_to_terminal, complete, self, prompt);
        output_put_text(&self->output, "vergence: \"help\" lists the commands\r\n");
        editor_begin(&self->editor);
    }
}

void connection_await_greeting(struct connection *self, const char *token, uint64_t now_us) {
    INVARIANT(self->used && !self->terminal);
    self->greeted = false;
    self->token = token;
    self->begun_us = now_us;
}

/// Whether a person is typing at this terminal.
static bool is_edited(const struct connection *self) {
    return self->terminal && !self->program;
}

/// Whether a command or a watch is running.
static bool is_busy(const struct connection *self) {
    return atomic_load(&self->job.state) != JOB_FREE || self->job.watch.on;
}

static void free_payload(struct job_payload *payload) {
    free(payload->data);
    *payload = (struct job_payload){.data = NULL};
}

/// Whether the next input is for the editor, or else for a program's next line. A client that does
/// not read its answers gets no more.
static bool is_ready(struct connection *self, bool edited) {
    return is_edited(self) == edited && !is_busy(self) && self->payload.data == NULL &&
           output_length(&self->output) <= OUTPUT_BACKLOG_BYTES;
}

// ---- input

bool connection_has_room(const struct connection *self) {
    INVARIANT(self->input_bytes <= sizeof self->input);
    return self->used && !self->ended && !self->gone && self->input_bytes < sizeof self->input;
}

/// Removes the first `bytes` bytes, which have been used.
static void forget(struct connection *self, size_t bytes) {
    INVARIANT(bytes <= self->input_bytes);
    memmove(self->input, self->input + bytes, self->input_bytes - bytes);
    self->input_bytes -= bytes;
}

/// Cancels what runs. A job that waits for another client's is answered here, as the other may take
/// long.
static void cancel(struct connection *self) {
    struct job *job = &self->job;
    if (!is_busy(self)) {
        return;
    }
    INVARIANT(job->worker != NULL);  // a watch has run, too
    atomic_store(&job->cancelled, true);
    if (atomic_load(&job->state) == JOB_WAITING && worker_withdraw(job->worker, job)) {
        job->watch.on = false;
        dispatch_answer(self->dispatch, job, ERROR_CANCELLED, error_text(ERROR_CANCELLED));
        atomic_store(&job->state, JOB_DONE);
    }
}

/// Whether a Ctrl-C follows in the buffer.
static bool ctrl_c_follows(const struct connection *self) {
    return memchr(self->input, CTRL_C, self->input_bytes) != NULL;
}

/// While a command runs, a Ctrl-C behind it counts at once.
static void look_for_ctrl_c(struct connection *self) {
    if (!is_busy(self) || !ctrl_c_follows(self)) {
        return;
    }
    if (is_edited(self)) {
        INVARIANT(!self->framed);
        const char *last = memrchr(self->input, CTRL_C, self->input_bytes);
        output_put_text(&self->output, "^C\r\n");
        forget(self, (size_t)(last + 1 - self->input));
    }
    cancel(self);
}

void connection_read(struct connection *self, short events) {
    if ((events & POLLIN) != 0 && connection_has_room(self)) {
        const ssize_t bytes = read(self->in_fd, self->input + self->input_bytes,
                                   sizeof self->input - self->input_bytes);
        if (bytes > 0) {
            self->input_bytes += (size_t)bytes;
            look_for_ctrl_c(self);
        } else if (bytes == 0) {
            self->ended = true;
        } else if (errno != EAGAIN && errno != EINTR) {
            connection_gone(self);
        }
    } else if ((events & (POLLHUP | POLLERR | POLLNVAL)) != 0 && (events & POLLIN) == 0) {
        // Both directions are closed; of a pipe with a separate output only this one.
        if (self->in_fd == self->out_fd) {
            connection_gone(self);
        } else {
            self->ended = true;
        }
    }
}

void connection_gone(struct connection *self) {
    self->gone = true;
    self->ended = true;
    self->input_bytes = 0;
    output_reset(&self->output, true);
    free_payload(&self->payload);
    cancel(self);
    if (atomic_load(&self->job.state) == JOB_FREE) {
        self->job.watch.on = false;
    }
}

// ---- a line

/// Shows the next prompt.
static void begin_editing(struct connection *self) {
    if (is_edited(self) && !self->ended) {
        editor_begin(&self->editor);
    }
}

/// Handles a line of options alone, which apply to all following lines.
static bool set_options(struct connection *self, const char *line) {
    struct job *job = &self->job;
    const char *command = job->request.command;
    if (line[0] != '@' || command[strspn(command, " \t")] != '\0') {
        return false;
    }
    self->json = job->request.json;
    self->progress = job->request.progress;
    self->greeted = true;
    dispatch_answer(self->dispatch, job, 0, "");
    return true;
}

/// Parses a line into the job. 0, also without a command; or an error with a message.
static int parse_line(struct connection *self, const char *line, char *message,
                      size_t message_bytes) {
    struct job *job = &self->job;
    job->command = NULL;
    int error = request_parse(line, &job->request, message, message_bytes);
    if (self->framed && !job->request.framed) {
        job->request.framed = true;
        snprintf(message, message_bytes,
                 FRAMING_DAMAGED ", which \"@framed\" requires (\"@terminal\" ends that)");
        return ERROR_CRC;
    }
    if (error != ERROR_OK || set_options(self, line)) {
        return error;
    }
    error = dispatch_parse(self->dispatch, job->request.command, job, message, message_bytes);
    if (error != ERROR_OK || job->command == NULL) {
        return error;
    }
    self->greeted = true;
    if (!is_edited(self) && ctrl_c_follows(self)) {
        snprintf(message, message_bytes, "%s", error_text(ERROR_CANCELLED));
        return ERROR_CANCELLED;
    }
    return ERROR_OK;
}

/// Turns a line into a job and queues it.
static void begin_line(struct connection *self, const char *line) {
    struct job *job = &self->job;
    char message[JOB_MESSAGE_BYTES];
    INVARIANT(atomic_load(&job->state) == JOB_FREE && !job->watch.on);
    job->terminal = is_edited(self);
    job->request = (struct request){.json = self->json, .progress = self->progress};
    job->round = false;
    atomic_store(&job->cancelled, false);
    const int error = parse_line(self, line, message, sizeof message);
    if (error != ERROR_OK) {
        dispatch_answer(self->dispatch, job, error, message);
    } else if (job->command != NULL) {
        atomic_store(&job->state, JOB_WAITING);
        dispatch_submit(self->dispatch, job);
    }
}

/// Handles @program, @framed and @terminal, which set the user of a terminal: a program or a
/// person. False: another line.
static bool change_side(struct connection *self, const char *line) {
    const bool framed = strcmp(line, "@framed") == 0;
    const bool program = framed || strcmp(line, "@program") == 0;
    if (!self->terminal || (!program && strcmp(line, "@terminal") != 0)) {
        return false;
    }
    const bool returns = self->program && !program;
    self->program = program;
    self->framed = framed;
    self->json = false;
    self->progress = false;
    INVARIANT(self->program || !self->framed);
    output_put_text(&self->output, "OK\r\n");
    if (returns) {
        editor_begin(&self->editor);
    }
    return true;
}

/// Feeds the editor one key.
static void take_key(struct connection *self, char key) {
    INVARIANT(is_edited(self) && !is_busy(self));
    const enum editor_event event = editor_feed(&self->editor, key);
    if (event == EDITOR_END) {
        output_put_text(&self->output, "\r\n");
        self->ended = true;
    } else if (event == EDITOR_LINE && !change_side(self, self->editor.line)) {
        begin_line(self, self->editor.line);
    }
    if (event != EDITOR_MORE && event != EDITOR_END && !is_busy(self)) {
        begin_editing(self);
    }
}

/// Feeds the editor until it has a line or has output more than is read at once: a single key may
/// redraw the whole line.
static void step_terminal(struct connection *self) {
    size_t used = 0;
    while (used < self->input_bytes && !self->ended && is_ready(self, true)) {
        take_key(self, self->input[used++]);
    }
    forget(self, used);
    look_for_ctrl_c(self);
}

/// Answers a program's line that is not parsed.
static void answer_unread(struct connection *self, int error, const char *message) {
    INVARIANT(!is_busy(self));
    self->job.request = (struct request){.json = self->json};
    self->job.terminal = false;
    dispatch_answer(self->dispatch, &self->job, error, message);
}

// ---- the first line

/// Handles a line that only identifies a client that has not greeted: over TCP the token, which no
/// web page knows. False: a line like any other.
static bool take_greeting(struct connection *self, const char *line, size_t length) {
    const size_t prefix = sizeof TOKEN_PREFIX - 1;
    INVARIANT(!self->greeted && !self->terminal);
    if (listener_is_http(line, length)) {
        self->hangs_up = "sent an HTTP request";
        connection_gone(self);
        return true;
    }
    const bool given = length >= prefix && memcmp(line, TOKEN_PREFIX, prefix) == 0;
    if (self->token == NULL && !given) {
        return false;
    }
    if (given && (self->token == NULL || token_is(self->token, line + prefix, length - prefix))) {
        self->greeted = true;
        answer_unread(self, 0, "");
        return true;
    }
    self->hangs_up = "sent no valid token over TCP";
    answer_unread(
        self, ERROR_REFUSED,
        "over TCP the first line must be \"@token TOKEN\" (the setting \"tcp_token\" names the "
        "file; vergence --connect finds it, or takes --token FILE)");
    self->ended = true;
    self->input_bytes = 0;
    return true;
}

// ---- lines of a program

/// Handles a complete line, or the beginning of one that is too long.
static void take_line(struct connection *self, const char *line, size_t length) {
    if (memchr(line, '\0', length) != NULL) {
        answer_unread(self, ERROR_SYNTAX, "the line contains a control character");
    } else if (length == JOB_LINE_BYTES) {
        answer_unread(self, ERROR_SYNTAX, "the line is longer than 512 characters");
    } else if (!change_side(self, line)) {
        begin_line(self, line);
    }
}

/// Takes up to JOB_LINE_BYTES bytes of input, which are `length` long without their end.
static void use_line(struct connection *self, size_t length, bool whole) {
    char line[JOB_LINE_BYTES + 1];
    const size_t bytes = length < JOB_LINE_BYTES ? length : JOB_LINE_BYTES;
    const bool skipped = self->skipping;
    memcpy(line, self->input, bytes);
    line[bytes] = '\0';
    self->skipping = !whole;
    forget(self, length < self->input_bytes ? length + 1 : length);
    const bool blank = strspn(line, " \t") == bytes;
    if (!skipped && !blank && (self->greeted || !take_greeting(self, line, bytes))) {
        take_line(self, line, bytes);
    }
}

/// Handles the next line. False: it is not complete.
static bool step_lines(struct connection *self) {
    size_t length = 0;
    INVARIANT(self->input_bytes > 0 && !is_busy(self));
    while (length < self->input_bytes && memchr("\r\n\3", self->input[length], 3) == NULL) {
        length++;
    }
    const bool ends = length < self->input_bytes;
    if (ends && self->input[length] == CTRL_C) {
        forget(self, length + 1);
        self->skipping = false;
        return true;
    }
    // The last line may have no line end.
    const bool whole = ends || self->ended;
    if (!whole && length < JOB_LINE_BYTES) {
        return false;
    }
    use_line(self, length, whole);
    return true;
}

// ---- jobs

/// Completes a command that has been answered.
static void take_answer(struct connection *self, uint64_t now_us) {
    struct job *job = &self->job;
    INVARIANT(atomic_load(&job->state) == JOB_DONE && self->payload.data == NULL);
    job->bar_columns = 0;
    self->payload = job->payload;
    self->payload_sent = 0;
    job->payload = (struct job_payload){.data = NULL};
    if (self->gone) {
        free_payload(&self->payload);
    }
    atomic_store(&job->state, JOB_FREE);
    if (job->quit) {
        job->quit = false;
        self->ended = true;
        self->input_bytes = 0;
    }
    if (job->watch.on && !self->gone) {
        // The rounds keep their period; missed rounds are not made up.
        const uint64_t beat_us = self->watch_us + job->watch.interval_us;
        self->watch_us = job->round && beat_us > now_us ? beat_us : now_us;
        return;
    }
    job->watch.on = false;
    begin_editing(self);
}

/// Runs the next round of a watch, or ends it.
static void step_watch(struct connection *self, uint64_t now_us) {
    struct job *job = &self->job;
    char message[JOB_MESSAGE_BYTES];
    const bool cancelled = atomic_load(&job->cancelled);
    INVARIANT(job->watch.on && job->watch.interval_us > 0);
    if (!cancelled && now_us < self->watch_us) {
        return;
    }
    if (cancelled) {
        dispatch_answer(self->dispatch, job, ERROR_CANCELLED, error_text(ERROR_CANCELLED));
    } else {
        job->round = true;
        const int error =
            dispatch_parse(self->dispatch, job->watch.line, job, message, sizeof message);
        INVARIANT(error == ERROR_OK && job->command != NULL);
        atomic_store(&job->state, JOB_WAITING);
        dispatch_submit(self->dispatch, job);
    }
    // Already answered: cancelled, or the queue is full.
    if (atomic_load(&job->state) == JOB_FREE) {
        job->watch.on = false;
        begin_editing(self);
    }
}

/// A client with CRC-framed lines waits for heartbeats, since an answer may have been lost.
static void show_life(struct connection *self, uint64_t now_us) {
    static const char idle[] = {FRAMING_IDLE};
    if (self->framed && is_busy(self) && now_us - self->life_us >= LIFE_US &&
        output_length(&self->output) == 0) {
        self->life_us = now_us;
        output_put(&self->output, idle, sizeof idle);
    }
}

void connection_step(struct connection *self, uint64_t now_us) {
    if (atomic_load(&self->job.state) == JOB_DONE) {
        take_answer(self, now_us);
    }
    show_life(self, now_us);
    if (self->gone) {
        return;
    }
    if (self->job.watch.on && atomic_load(&self->job.state) == JOB_FREE &&
        output_length(&self->output) <= OUTPUT_BACKLOG_BYTES) {
        step_watch(self, now_us);
        return;
    }
    if (is_ready(self, true)) {
        step_terminal(self);
    }
    while (self->input_bytes > 0 && is_ready(self, false) && step_lines(self)) {
    }
}

uint64_t connection_due_us(const struct connection *self) {
    const bool waits = atomic_load(&self->job.state) == JOB_FREE && self->job.watch.on;
    return self->used && waits ? self->watch_us : UINT64_MAX;
}

bool connection_has_output(struct connection *self) {
    return output_length(&self->output) > 0 || self->payload.data != NULL;
}

/// Removes bytes that were sent, of the output or else of the payload.
static void take_sent(struct connection *self, size_t bytes, bool of_output) {
    if (of_output) {
        output_take(&self->output, bytes);
        return;
    }
    self->payload_sent += bytes;
    if (self->payload_sent == self->payload.bytes) {
        free_payload(&self->payload);
    }
}

void connection_send(struct connection *self, uint64_t now_us) {
    char data[SEND_BYTES];
    for (;;) {
        const size_t ready = output_peek(&self->output, data, sizeof data);
        const struct job_payload *payload = &self->payload;
        if (ready == 0 && payload->data == NULL) {
            self->stalled_us = 0;
            return;
        }
        const void *from = ready > 0 ? (const void *)data : payload->data + self->payload_sent;
        const size_t bytes = ready > 0 ? ready : payload->bytes - self->payload_sent;
        const ssize_t sent = write(self->out_fd, from, bytes);
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
        take_sent(self, (size_t)sent, ready > 0);
    }
}

bool connection_over(struct connection *self) {
    if (!self->used || is_busy(self)) {
        return false;
    }
    return self->gone || (self->ended && (self->input_bytes == 0 || is_edited(self)) &&
                          !connection_has_output(self));
}

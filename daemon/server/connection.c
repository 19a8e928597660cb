// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/connection.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/server/admission.h"
#include "daemon/server/completion.h"
#include "daemon/server/connection_input.h"
#include "daemon/server/server.h"

enum {
    CTRL_C = 3,
    SEND_BYTES = 4096,
    BACKLOG_BYTES = OUTPUT_BYTES / 4,
    LIFE_US = 500000  ///< between two heartbeats
};

static const char prompt[] = "vergence> ";

static void send_to_terminal(void *cookie, const char *data, size_t bytes) {
    struct connection *self = cookie;
    output_put(&self->output, data, bytes);
}

static void complete(void *cookie, const char *typed, char *words) {
    const struct connection *self = cookie;
    // Uses only what never changes: the workers run in other threads.
    completion_candidates(self->server->daemon, typed, words, EDITOR_WORDS_BYTES);
}

bool connection_init(struct connection *self, struct server *server, int wake_fd, bool terminal) {
    memset(self, 0, sizeof *self);
    self->server = server;
    self->in_fd = -1;
    self->out_fd = -1;
    self->job.output = &self->output;
    return output_open(&self->output, wake_fd) && (!terminal || output_open_saved(&self->output));
}

void connection_destroy(struct connection *self) {
    output_close(&self->output);
}

void connection_begin(struct connection *self, enum connection_kind kind, int in_fd, int out_fd,
                      const char *name) {
    INVARIANT(!self->used && atomic_load(&self->job.state) == JOB_FREE);
    self->used = true;
    self->greeted = true;
    self->token = NULL;
    self->hangs_up = NULL;
    self->kind = kind;
    self->program = false;
    self->framed = false;
    self->last_request_id = REQUEST_ID_NONE;
    self->in_fd = in_fd;
    self->out_fd = out_fd;
    snprintf(self->name, sizeof self->name, "%s", name);
    self->json = false;
    self->progress = false;
    self->ended = false;
    self->gone = false;
    self->input_bytes = 0;
    self->refused_bytes = 0;
    self->ctrl_c_ahead = false;
    self->skipping = false;
    self->overflowed = false;
    self->dropping = false;
    self->dropped_lines = 0;
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

void connection_await_greeting(struct connection *self, const char *token, uint64_t now_us) {
    self->greeted = false;
    self->token = token;
    self->begun_us = now_us;
}

/// Shows the next prompt, unless pasted input that is being dropped is still arriving.
static void begin_editing(struct connection *self) {
    if (connection_is_edited(self) && !self->ended && !self->overflowed) {
        editor_begin(&self->editor);
    }
}

/// Reports at the terminal that typed-ahead input was dropped.
static void step_overflow(struct connection *self) {
    if (!self->overflowed || connection_input_is_overflowing(self)) {
        return;
    }
    output_put_text(&self->output, self->dropping
                                       ? "vergence: too much typed ahead: input up to the next "
                                         "Enter is dropped\r\n"
                                       : "vergence: too much typed ahead: input dropped\r\n");
    connection_input_end_overflow(self);
    begin_editing(self);
}

/// Checks whether a well-formed line is allowed now. 0, or an error with a message.
static int look_at_request(const struct connection *self, const struct request *request,
                           char *message, size_t message_bytes) {
    if (self->framed && !request->framed) {
        snprintf(message, message_bytes,
                 "this line has no CRC, which \"@framed\" requires (\"@terminal\" ends that)");
        return ERROR_CRC;
    }
    if (request->exactly_once && !self->framed) {
        snprintf(message, message_bytes,
                 "the console was restarted after \"@framed\": it does not know which commands "
                 "were run");
        return ERROR_RESTARTED;
    }
    return 0;
}

/// Repeats the last answer to a command that is run at most once and is asked for again.
static bool repeat_answer(struct connection *self) {
    const struct request *request = &self->job.request;
    if (request->exactly_once && request->id == self->last_request_id) {
        output_repeat(&self->output);
        return true;
    }
    self->last_request_id = request->exactly_once ? request->id : self->last_request_id;
    return false;
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
    server_answer(self->server, job, 0, "");
    return true;
}

/// Parses the command of a line; a refused one is an error. 0, or an error with a message.
static int parse_command(struct connection *self, bool refused, char *message,
                         size_t message_bytes) {
    struct job *job = &self->job;
    const int error = server_parse(self->server, job->request.command, job, message, message_bytes);
    if (error != 0 || job->command == NULL) {
        return error;
    }
    self->greeted = true;
    if (refused) {
        snprintf(message, message_bytes, "%s", error_text(ERROR_CANCELLED));
        return ERROR_CANCELLED;
    }
    return 0;
}

/// Turns a line into a job and queues it; a refused line is only answered.
static void begin_line(struct connection *self, const char *line, bool refused) {
    struct job *job = &self->job;
    char message[JOB_MESSAGE_BYTES];
    INVARIANT(atomic_load(&job->state) == JOB_FREE);
    job->terminal = connection_is_edited(self);
    job->request = (struct request){.json = self->json, .progress = self->progress};
    job->round = false;
    atomic_store(&job->cancelled, false);
    int error = request_parse(line, &job->request, message, sizeof message);
    error = error != 0 ? error : look_at_request(self, &job->request, message, sizeof message);
    job->request.exactly_once = job->request.exactly_once && error == 0;
    if (repeat_answer(self)) {
        return;
    }
    job->command = NULL;
    if (error == 0 && set_options(self, line)) {
        return;
    }
    error = error != 0 ? error : parse_command(self, refused, message, sizeof message);
    if (error != 0) {
        server_answer(self->server, job, error, message);
    } else if (job->command != NULL) {
        atomic_store(&job->state, JOB_WAITING);
        server_submit(self->server, job);
    }
}

/// Handles @program, @framed and @terminal, which set the user of a terminal: a program or a
/// person. False: another line.
static bool change_side(struct connection *self, const char *line) {
    const bool framed = strcmp(line, "@framed") == 0;
    const bool program = framed || strcmp(line, "@program") == 0;
    if (self->kind != CONNECTION_TERMINAL || (!program && strcmp(line, "@terminal") != 0)) {
        return false;
    }
    const bool returns = self->program && !program;
    self->program = program;
    self->framed = framed;
    self->last_request_id = REQUEST_ID_NONE;
    self->json = false;
    self->progress = false;
    output_put_text(&self->output, "OK\r\n");
    if (returns) {
        editor_begin(&self->editor);
    }
    return true;
}

/// Whether the client reads its answers, so that it gets more.
static bool has_room(struct connection *self) {
    return output_length(&self->output) <= BACKLOG_BYTES;
}

/// Whether the next input is for the editor, or else for a program's next line.
static bool is_ready(struct connection *self, bool edited) {
    return connection_is_edited(self) == edited && !connection_is_busy(self) && has_room(self);
}

/// Feeds the editor one key.
static void take_key(struct connection *self, char key) {
    if (self->skipping && key != CTRL_C) {
        self->skipping = !connection_input_is_line_end(key);
        return;
    }
    self->skipping = false;
    const enum editor_event event = editor_feed(&self->editor, key);
    if (event == EDITOR_END) {
        output_put_text(&self->output, "\r\n");
        self->ended = true;
    } else if (event == EDITOR_LINE && !change_side(self, self->editor.line)) {
        begin_line(self, self->editor.line, false);
    }
    if (event != EDITOR_MORE && event != EDITOR_END && !connection_is_busy(self) &&
        connection_is_edited(self)) {
        editor_begin(&self->editor);
    }
}

/// Feeds the editor until it has a line or has output more than is read at once: a single key may
/// redraw the whole line.
static void step_terminal(struct connection *self) {
    size_t used = 0;
    while (used < self->input_bytes && !self->ended && is_ready(self, true)) {
        take_key(self, self->input[used++]);
    }
    connection_input_forget(self, used);
}

/// Answers a program's line that is not parsed.
static void answer_unread(struct connection *self, int error, const char *message) {
    self->job.request = (struct request){.json = self->json, .id = REQUEST_ID_NONE};
    self->job.terminal = false;
    server_answer(self->server, &self->job, error, message);
}

/// Handles a first line that only identifies the client.
static void take_greeting(struct connection *self, enum admission admission) {
    if (admission == ADMISSION_TOKEN) {
        self->greeted = true;
        answer_unread(self, 0, "");
        return;
    }
    if (admission == ADMISSION_HTTP) {
        self->hangs_up = "sent an HTTP request";
        connection_gone(self);
        return;
    }
    self->hangs_up = "sent no valid token over TCP";
    answer_unread(
        self, ERROR_REFUSED,
        "over TCP the first line must be \"@token TOKEN\" (the setting \"tcp_token\" names the "
        "file; vergence --connect finds it, or takes --token FILE)");
    self->ended = true;
    connection_input_forget(self, self->input_bytes);
}

/// Length of the first line of the input, without its end.
static size_t first_line_length(const struct connection *self) {
    size_t length = 0;
    while (length < self->input_bytes && !connection_input_is_line_end(self->input[length])) {
        length++;
    }
    return length;
}

/// Copies the first line of the input. False, and "": it is too long or contains a 0.
static bool copy_line(const struct connection *self, size_t length, char line[JOB_LINE_BYTES]) {
    const bool fits = length < JOB_LINE_BYTES && memchr(self->input, '\0', length) == NULL;
    memcpy(line, self->input, fits ? length : 0);
    line[fits ? length : 0] = '\0';
    return fits;
}

/// Runs a line of a program. `fits` false: `line` is empty, as it was too long or contained a 0.
static void take_line(struct connection *self, const char *line, size_t length, bool fits,
                      bool refused) {
    const bool empty = fits && line[strspn(line, " \t")] == '\0';
    if (empty || change_side(self, line)) {
        return;
    }
    if (fits) {
        begin_line(self, line, refused);
    } else {
        answer_unread(self, ERROR_SYNTAX,
                      length < JOB_LINE_BYTES ? "the line contains a control character"
                                              : "the line is longer than 512 characters");
    }
}

/// Handles the next complete line of a program. False: there is no complete line.
static bool step_lines(struct connection *self) {
    const size_t length = first_line_length(self);
    // The last line may have no line end.
    const bool whole = length < self->input_bytes || (self->ended && length > 0);
    if (!whole && length < JOB_LINE_BYTES) {
        return false;
    }
    char line[JOB_LINE_BYTES];
    const bool fits = copy_line(self, length, line);
    const bool skipped = self->skipping;
    const bool refused = self->refused_bytes > 0 || self->ctrl_c_ahead;
    const enum admission admission =
        self->greeted || skipped ? ADMISSION_LINE : admission_of(self->input, length, self->token);
    self->skipping = !whole;
    connection_input_forget(self, whole && length < self->input_bytes ? length + 1 : length);
    if (admission != ADMISSION_LINE) {
        take_greeting(self, admission);
    } else if (!skipped) {
        take_line(self, line, length, fits, refused);
    }
    return true;
}

/// Answers the next dropped line, once those before it are answered. False: there is none.
static bool step_dropped(struct connection *self) {
    if (!self->overflowed || self->input_bytes > 0) {
        return false;
    }
    if (self->dropped_lines == 0) {
        connection_input_end_overflow(self);
        return false;
    }
    self->dropped_lines--;
    answer_unread(self, ERROR_BUSY, "too much was sent ahead: the line was not run");
    return true;
}

/// Completes a command that has been answered.
static void take_answer(struct connection *self, uint64_t now_us) {
    struct job *job = &self->job;
    job->bar_shown = false;
    atomic_store(&job->state, JOB_FREE);
    if (job->quit) {
        job->quit = false;
        self->ended = true;
        connection_input_forget(self, self->input_bytes);
    }
    if (job->watch.on && !self->gone) {
        // The rounds keep their period; missed rounds are not made up.
        const uint64_t beat_us = self->watch_us + job->watch.interval_us;
        self->watch_us = !job->round ? now_us : beat_us > now_us ? beat_us : now_us;
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
    if (!cancelled && now_us < self->watch_us) {
        return;
    }
    if (cancelled) {
        server_answer(self->server, job, ERROR_CANCELLED, error_text(ERROR_CANCELLED));
    } else {
        job->round = true;
        const int error = server_parse(self->server, job->watch.line, job, message, sizeof message);
        INVARIANT(error == 0 && job->command != NULL);
        atomic_store(&job->state, JOB_WAITING);
        server_submit(self->server, job);
    }
    // Already answered: cancelled, or the queue is full.
    if (atomic_load(&job->state) == JOB_FREE) {
        job->watch.on = false;
        begin_editing(self);
    }
}

/// A client with CRC-framed lines waits for heartbeats, since an answer may have been lost.
static void show_life(struct connection *self, uint64_t now_us) {
    static const char idle[] = {CONNECTION_IDLE};
    if (self->framed && connection_is_busy(self) && now_us - self->life_us >= LIFE_US &&
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
    // A client that does not read its answers gets no more.
    if (self->gone || atomic_load(&self->job.state) != JOB_FREE || !has_room(self)) {
        return;
    }
    if (self->job.watch.on) {
        step_watch(self, now_us);
        return;
    }
    if (connection_is_edited(self)) {
        step_overflow(self);
        step_terminal(self);
    }
    while (self->input_bytes > 0 && is_ready(self, false) && step_lines(self)) {
    }
    while (is_ready(self, false) && step_dropped(self)) {
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
    if (!self->used || connection_is_busy(self)) {
        return false;
    }
    const bool read = self->input_bytes == 0 && !self->overflowed;
    return self->gone || (self->ended && (read || connection_is_edited(self)) &&
                          output_length(&self->output) == 0);
}

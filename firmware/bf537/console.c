// SPDX-License-Identifier: Apache-2.0
#include "bf537/console.h"

#include <string.h>

#include "bf537/clock.h"
#include "bf537/fault.h"
#include "bf537/watchdog.h"
#include "console/command_text.h"
#include "console/line/completion.h"
#include "console/line/framing.h"
#include "core/error.h"
#include "core/invariant.h"

enum { CTRL_C = 3 };

static const char prompt[] = "vergence> ";

static void send(void *context, const char *data, size_t bytes) {
    struct bf537_console *self = context;
    bf537_watchdog_feed();  // a long answer takes seconds at this line
    bf537_serial_send(self->serial, data, bytes);
}

static void send_text(struct bf537_console *self, const char *text) {
    send(self, text, strlen(text));
}

static void put(void *context, const void *data, size_t bytes) {
    send(context, data, bytes);
}

static void complete(void *context, const char *typed, char *words) {
    const struct bf537_console *self = context;
    completion_words(&self->table, self, typed, words, EDITOR_WORDS_BYTES);
}

// ---- a running command

static void show_life(struct bf537_console *self) {
    self->sign_of_life_us = bf537_now_us();
    if (self->framed) {
        send(self, (const char[]){FRAMING_BUSY}, 1);
    }
}

static bool should_stop(void *context) {
    struct bf537_console *self = context;
    const uint64_t now_us = bf537_now_us();
    bf537_watchdog_feed();
    bf537_fault_check_stack();
    if (now_us - self->sign_of_life_us >= 1000 * FRAMING_IDLE_MS) {
        show_life(self);
    }
    if (bf537_serial_drop_through(self->serial, CTRL_C)) {
        self->cancelled = true;
        send_text(self, self->program ? "" : "^C\r\n");
    }
    return self->cancelled;
}

static void show_progress(void *context, const char *what, uint32_t done, uint32_t total) {
    struct bf537_console *self = context;
    reply_progress(&self->reply, what, done, total);
    show_life(self);
}

struct rig_observer bf537_console_observer(struct bf537_console *self) {
    return (struct rig_observer){should_stop, show_progress, self};
}

// ---- a line

static void answer(struct bf537_console *self, const struct request *request, int error,
                   const char *message) {
    const struct reply_sink sink = {put, self};
    reply_begin(&self->reply, &sink, request, !self->program);
    reply_end(&self->reply, error, message);
}

static void run(struct bf537_console *self, const struct request *request,
                const struct command *command) {
    const struct reply_sink sink = {put, self};
    const struct command_call call = {.rig = self->rig,
                                      .values = self->values,
                                      .reply = &self->reply.items,
                                      .message = self->message,
                                      .message_bytes = sizeof self->message,
                                      .table = self->table,
                                      .context = self,
                                      .line = request->command};
    self->cancelled = false;
    self->message[0] = '\0';
    reply_begin(&self->reply, &sink, request, !self->program);
    show_life(self);
    const int error = command_run(command, &call);
    reply_end(&self->reply, error, self->message);
}

/// A line of options alone applies to all that follow.
static bool set_options(struct bf537_console *self, const char *line,
                        const struct request *request) {
    if (line[0] != '@' || request->command[strspn(request->command, " \t")] != '\0') {
        return false;
    }
    self->json = request->json;
    self->progress = request->progress;
    answer(self, request, ERROR_OK, "");
    return true;
}

/// @program, @framed and @terminal say who is at the line.
static bool change_side(struct bf537_console *self, const char *line) {
    const bool framed = strcmp(line, "@framed") == 0;
    const bool program = framed || strcmp(line, "@program") == 0;
    if (!program && strcmp(line, "@terminal") != 0) {
        return false;
    }
    self->program = program;
    self->framed = framed;
    self->json = false;
    self->progress = false;
    send_text(self, "OK\r\n");
    return true;
}

static void take_line(struct bf537_console *self, const char *line) {
    struct request request = {.json = self->json, .progress = self->progress};
    const struct command *command = NULL;
    if (change_side(self, line)) {
        return;
    }
    int error = request_parse(line, &request, self->message, sizeof self->message);
    if (self->framed && !request.framed) {
        request.framed = true;
        answer(self, &request, ERROR_CRC,
               FRAMING_DAMAGED ", which \"@framed\" requires (\"@terminal\" ends that)");
        return;
    }
    if (error == ERROR_OK && set_options(self, line, &request)) {
        return;
    }
    if (error == ERROR_OK) {
        error = command_parse(request.command, self->table.rows, self->table.count, self->storage,
                              self->values, &command, self->message, sizeof self->message);
    }
    if (error != ERROR_OK) {
        answer(self, &request, error, self->message);
    } else if (command != NULL) {
        run(self, &request, command);
    }
}

// ---- input

static void take_key(struct bf537_console *self, char key) {
    const enum editor_event event = editor_feed(&self->editor, key);
    if (event == EDITOR_LINE) {
        take_line(self, self->editor.line);
    }
    if (event != EDITOR_MORE && !self->program) {
        editor_begin(&self->editor);
    }
}

static void take_byte(struct bf537_console *self, char byte) {
    if (byte != '\n' && byte != '\r') {
        self->too_long |= self->line_bytes == sizeof self->line - 1;
        if (!self->too_long && byte != CTRL_C) {
            self->line[self->line_bytes++] = byte;
        }
        return;
    }
    const bool too_long = self->too_long;
    const bool empty = self->line_bytes == 0;
    self->line[self->line_bytes] = '\0';
    self->line_bytes = 0;
    self->too_long = false;
    if (too_long) {
        const struct request request = {.json = self->json, .framed = self->framed};
        answer(self, &request, ERROR_SYNTAX, "the line is too long");
    } else if (!empty) {
        take_line(self, self->line);
    }
    if (!self->program) {
        editor_begin(&self->editor);
    }
}

void bf537_console_step(struct bf537_console *self) {
    char byte;
    while (bf537_serial_take(self->serial, &byte, 1) > 0) {
        if (self->program) {
            take_byte(self, byte);
        } else {
            take_key(self, byte);
        }
    }
}

void bf537_console_begin(struct bf537_console *self, struct bf537_serial *serial, struct rig *rig,
                         struct command_table table) {
    memset(self, 0, sizeof *self);
    self->serial = serial;
    self->rig = rig;
    self->table = table;
    reply_init(&self->reply);
    editor_init(&self->editor, send, complete, self, prompt);
    send_text(self, "vergence: \"help\" lists the commands\r\n");
    editor_begin(&self->editor);
}

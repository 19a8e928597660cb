// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/play.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/command.h"
#include "console/pair/capture.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/replay/replay.h"
#include "daemon/session/session_write.h"
#include "daemon/settings/config.h"

enum { TABLE_MAX = 64, COMMAND_MESSAGE_BYTES = 512 };

/// A replay in progress. Large: allocated.
struct play {
    const struct play_observer *observer;
    struct play_outcome *outcome;
    struct replay replay;
    uint32_t calls;        ///< recorded calls
    struct config config;  ///< settings of the recording
    struct rig rig;
    struct command table[TABLE_MAX];
    size_t table_count;
    bool cancelled;          ///< the observer has asked to stop
    bool command_cancelled;  ///< the recording says that this command was cancelled
    bool taken;              ///< `again` holds a pair that is not yet compared
    struct session_event again;
    char line[2][SESSION_LINE_MAX + 1];
    char why[COMMAND_MESSAGE_BYTES];  ///< error text of the last failed command
};

// ---- observer

static bool rig_should_stop(void *cookie) {
    struct play *self = cookie;
    const struct play_observer *observer = self->observer;
    self->cancelled =
        self->cancelled || (observer->should_stop != NULL && observer->should_stop(observer->self));
    return self->cancelled || self->command_cancelled;
}

static void cancel_command(void *cookie) {
    struct play *self = cookie;
    self->command_cancelled = true;
}

static void show_progress(void *cookie, const char *what, uint32_t done, uint32_t total) {
    struct play *self = cookie;
    (void)what, (void)done, (void)total;
    if (self->observer->progress != NULL && self->calls > 0) {
        self->observer->progress(self->observer->self, "replaying", self->replay.made, self->calls);
    }
}

// ---- differences

static bool differs(const struct play *self) {
    return self->outcome->mismatch.text[0] != '\0';
}

/// Records a difference; only the first one counts.
static void diverge(struct play *self, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void diverge(struct play *self, const char *format, ...) {
    struct play_outcome *outcome = self->outcome;
    char what[MESSAGE_BYTES];
    va_list arguments;
    if (differs(self)) {
        return;
    }
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    INVARIANT(self->replay.made <= self->calls);
    outcome->command = outcome->commands + 1;
    outcome->call = self->replay.made + 1;
    message_set(&outcome->mismatch, 0, "%s", what);
}

/// Records a call that differs, unless only the cut-off end of the recording is missing.
static void look_for_error(struct play *self) {
    if (self->replay.ended && !(self->replay.ran_out && self->outcome->cut)) {
        diverge(self, "%s", self->replay.last_error.text);
    }
}

/// Records the first word in which two index lines differ.
static void diverge_in_pair(struct play *self) {
    const char *expected = self->line[0];
    const char *came = self->line[1];
    for (;;) {
        const size_t length = strcspn(expected, " ");
        if (strcspn(came, " ") != length || memcmp(expected, came, length) != 0) {
            break;
        }
        INVARIANT(expected[length] == ' ' && came[length] == ' ');
        expected += length + 1;
        came += length + 1;
    }
    diverge(self, "%s: pair %u: expected %.*s, got %.*s", self->replay.session.path,
            (unsigned)self->replay.event.pair.number, (int)strcspn(expected, " "), expected,
            (int)strcspn(came, " "), came);
}

// ---- commands

/// Keeps what the session would hold of the pair.
static int run_capture(const struct command_call *call) {
    struct play *self = call->context;
    static const struct pair_memory memory = {malloc, free};
    const struct pair_options options = capture_options(call->values, &memory);
    struct session_event *again = &self->again;
    again->kind = SESSION_PAIR;
    // Their values are part of the recorded calls, which must match.
    struct registers_all registers;
    const int error = capture_take(call->rig, &options, &again->pair, &registers);
    self->taken = error == ERROR_OK;
    for (int side = 0; self->taken && side < RIG_SIDES; side++) {
        again->frame_crc[side] = session_writer_frame_crc(&again->pair.frame[side].image);
        raw_image_release(&again->pair.frame[side].image);
    }
    return error;
}

/// A view is not stored; its frames are part of the recorded calls.
static int run_view(const struct command_call *call) {
    struct pair_look_frame looks[RIG_SIDES];
    const int error = view_take(call->rig, call->values, looks);
    if (error == ERROR_OK) {
        pair_look_release(looks);
    }
    return error;
}

/// The instrument's own commands, capture and view; other commands do not affect the
/// instrument.
static void make_table(struct play *self) {
    static const struct command more[] = {
        {.name = "capture",
         .summary = "",
         .help = "",
         .arguments = capture_arguments,
         .argument_count = CAPTURE_ARGUMENTS,
         .flags = COMMAND_NEEDS_RIG,
         .run = run_capture},
        {.name = "view",
         .summary = "",
         .help = "",
         .arguments = view_arguments,
         .argument_count = VIEW_ARGUMENTS,
         .flags = COMMAND_NEEDS_RIG,
         .run = run_view},
    };
    enum { MORE = sizeof more / sizeof more[0] };
    size_t count = 0;
    const struct command *table = command_rig_table(&count);
    INVARIANT(count + MORE <= TABLE_MAX);
    memcpy(self->table, table, count * sizeof *table);
    memcpy(self->table + count, more, sizeof more);
    self->table_count = count + MORE;
}

static void run_command(struct play *self) {
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    const struct command *command = NULL;
    char *const why = self->why;
    why[0] = '\0';
    const int error = command_parse(self->replay.event.text, self->table, self->table_count,
                                    storage, values, &command, why, COMMAND_MESSAGE_BYTES);
    if (error == ERROR_OK && command == NULL) {
        return;  // a note, which did nothing
    }
    (void)rig_idle(&self->rig);
    self->taken = false;
    self->command_cancelled = false;
    if (error != ERROR_OK) {
        diverge(self, "%s: cannot replay the command \"%.200s\": %s", self->replay.session.path,
                self->replay.event.text, why);
        return;
    }
    const struct command_call call = {.rig = &self->rig,
                                      .values = values,
                                      .message = why,
                                      .message_bytes = COMMAND_MESSAGE_BYTES,
                                      .context = self};
    // Its result is irrelevant: it did the same as recorded, or the calls differ.
    (void)command_run(command, &call);
    look_for_error(self);
    self->outcome->commands += !differs(self) && !self->replay.ended;
    show_progress(self, "", 0, 0);
}

static void compare_pair(struct play *self) {
    if (!self->taken) {
        diverge(self, "%s: pair %u was recorded here, but not captured%s%.500s",
                self->replay.session.path, (unsigned)self->replay.event.pair.number,
                self->why[0] != '\0' ? ": " : "", self->why);
        return;
    }
    self->taken = false;
    self->again.pair.number =
        self->replay.event.pair.number;  // the number in the session, not the instrument's
    for (int side = 0; side < RIG_SIDES; side++) {
        // Version 1 of the session format does not record how images were stored.
        self->again.pair.frame[side].has_picture = self->replay.event.pair.frame[side].has_picture;
    }
    const int expected = session_event_print(&self->replay.event, self->line[0]);
    const int came = session_event_print(&self->again, self->line[1]);
    INVARIANT(expected > 0 && came > 0);
    if (strcmp(self->line[0], self->line[1]) != 0) {
        diverge_in_pair(self);
        return;
    }
    self->outcome->pairs++;
}

/// Opens the recording, and sets up the rig as the daemon does at its start, or after
/// `record start`.
static int open_all(struct play *self, int parent, const char *path, struct message *message) {
    struct replay *replay = &self->replay;
    struct play_outcome *outcome = self->outcome;
    const struct rig_observer observer = {rig_should_stop, show_progress, self};
    config_defaults(&self->config);
    const int error = replay_open(replay, parent, path, &self->config, message);
    if (error != ERROR_OK) {
        return error;
    }
    memcpy(outcome->build, replay->build, sizeof outcome->build);
    memcpy(outcome->profile, replay->profile, sizeof outcome->profile);
    outcome->cut = replay->cut;
    if (replay->commands == 0 || !replay->has_calls) {
        return message_set(message, ERROR_MISSING,
                           "%s: contains no %s to replay (\"record start\" records them)", path,
                           replay->commands == 0 ? "commands" : "calls");
    }
    const char *missing = rig_ports_missing(&self->config.profile, &replay->ports);
    if (missing != NULL) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: its settings require %s, which was not recorded", path, missing);
    }
    self->calls = replay->calls;
    replay->cancel = cancel_command;
    replay->self = self;
    rig_init(&self->rig, &self->config.profile, &replay->ports, &observer);
    return ERROR_OK;
}

/// Replays event by event, up to the end, the first difference or the end of a cut recording.
static int play_events(struct play *self, struct message *message) {
    struct replay *replay = &self->replay;
    int got = 1;
    while (!self->cancelled && !differs(self) && !replay->ran_out &&
           (got = session_reader_next(&replay->session, &replay->event, message)) == 1) {
        if (replay->event.kind == SESSION_COMMAND) {
            run_command(self);
        } else if (replay->event.kind == SESSION_PAIR) {
            compare_pair(self);
        }
    }
    if (self->cancelled) {
        return message_set(message, ERROR_CANCELLED, "cancelled");
    }
    return got < 0 ? got : 0;
}

static int play_all(struct play *self, struct message *message) {
    const int error = play_events(self, message);
    if (error != ERROR_OK) {
        return error;
    }
    struct play_outcome *outcome = self->outcome;
    if (!self->replay.ended) {
        (void)rig_idle(&self->rig);
        look_for_error(self);
    }
    if (!differs(self) && !outcome->cut && !replay_is_over(&self->replay)) {
        diverge(self, "%s: the last %u recorded calls were not made", self->replay.session.path,
                (unsigned)self->replay.calls);
    }
    outcome->calls = self->replay.made;
    outcome->same = !differs(self);
    if (outcome->same && outcome->commands == 0) {
        return message_set(message, ERROR_MISSING,
                           "%s: cut off before its first command was complete: nothing to compare",
                           self->replay.session.path);
    }
    return ERROR_OK;
}

int play_session(int parent, const char *path, const struct play_observer *observer,
                 struct play_outcome *outcome, struct message *message) {
    struct play *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    memset(outcome, 0, sizeof *outcome);
    self->observer = observer;
    self->outcome = outcome;
    self->replay.session.directory = -1;
    make_table(self);
    int error = open_all(self, parent, path, message);
    error = error != ERROR_OK ? error : play_all(self, message);
    replay_close(&self->replay);
    free(self);
    return error;
}

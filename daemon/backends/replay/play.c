// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/play.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/command.h"
#include "console/reply_none.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/replay/replay.h"
#include "daemon/backends/replay/replay_profile.h"
#include "daemon/session/capture.h"
#include "daemon/session/session_write.h"
#include "daemon/settings/config.h"

enum { TABLE_MAX = 64, COMMAND_MESSAGE_BYTES = 512 };

/// A replay in progress. Large: allocated.
struct play {
    const struct play_observer *observer;
    struct play_outcome *outcome;
    struct replay replay;
    uint32_t calls;  ///< recorded calls
    struct session_reader session;
    struct session_event event;  ///< the current recorded event
    struct config config;        ///< settings of the recording
    bool up;                     ///< `rig` was initialised with `config`
    struct rig rig;
    struct command table[TABLE_MAX];
    size_t table_count;
    bool cancelled;          ///< by the observer
    bool command_cancelled;  ///< as recorded
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
    diverge(self, "%s: pair %u: expected %.*s, got %.*s", self->session.path,
            (unsigned)self->event.pair.number, (int)strcspn(expected, " "), expected,
            (int)strcspn(came, " "), came);
}

// ---- commands

/// Keeps what the session would hold of the pair.
static int run_capture(const struct command_call *call) {
    struct play *self = call->context;
    const struct pair_options options = capture_options(call->values);
    struct session_event *again = &self->again;
    again->kind = SESSION_PAIR;
    // Their values are part of the recorded calls, which must match.
    struct registers_all registers;
    const int error = capture_take(call->rig, &options, &again->pair, &registers);
    self->taken = error == 0;
    for (int side = 0; self->taken && side < RIG_SIDES; side++) {
        again->frame_crc[side] = session_writer_frame_crc(&again->pair.frame[side].image);
        raw_image_release(&again->pair.frame[side].image);
    }
    return error;
}

/// A snapshot is not stored; its frames are part of the recorded calls.
static int run_snapshot(const struct command_call *call) {
    struct pair_frame frames[RIG_SIDES];
    const int error = pair_look(call->rig, frames);
    if (error == 0) {
        pair_release(frames);
    }
    return error;
}

/// The instrument's own commands, capture and snapshot; other commands do not affect the
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
        {.name = "snapshot",
         .summary = "",
         .help = "",
         .arguments = snapshot_arguments,
         .argument_count = SNAPSHOT_ARGUMENTS,
         .flags = COMMAND_NEEDS_RIG,
         .run = run_snapshot},
    };
    enum { MORE = sizeof more / sizeof more[0] };
    size_t count = 0;
    const struct command *table = command_rig_table(&count);
    INVARIANT(count + MORE <= TABLE_MAX);
    memcpy(self->table, table, count * sizeof *table);
    memcpy(self->table + count, more, sizeof more);
    self->table_count = count + MORE;
}

/// Sets up the rig as the daemon does at its start, or after `record start`.
static void bring_rig(struct play *self) {
    const struct rig_observer observer = {rig_should_stop, show_progress, self};
    struct message why;
    // Sessions are untrusted input, and so are their settings and calls.
    if (config_check(&self->config, &why) != 0) {
        diverge(self, "%s: invalid settings: %.900s", self->session.path, why.text);
        return;
    }
    const char *missing = rig_ports_missing(&self->config.profile, &self->replay.ports);
    if (missing != NULL) {
        diverge(self, "%s: its settings require %s, which was not recorded", self->session.path,
                missing);
        return;
    }
    rig_init(&self->rig, &self->config.profile, &self->replay.ports, &observer);
    self->up = true;
}

static void run_command(struct play *self) {
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    const struct command *command = NULL;
    char *const why = self->why;
    if (!self->up) {
        bring_rig(self);
    }
    if (!self->up) {
        return;
    }
    (void)rig_idle(&self->rig);
    why[0] = '\0';
    self->taken = false;
    self->command_cancelled = false;
    const int error = command_parse(self->event.text, self->table, self->table_count, storage,
                                    values, &command, why, COMMAND_MESSAGE_BYTES);
    if (error != 0 || command == NULL) {
        diverge(self, "%s: cannot replay the command \"%.200s\": %s", self->session.path,
                self->event.text, why);
        return;
    }
    const struct command_call call = {.rig = &self->rig,
                                      .values = values,
                                      .reply = reply_none(),
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
        diverge(self, "%s: pair %u was recorded here, but not captured%s%.500s", self->session.path,
                (unsigned)self->event.pair.number, self->why[0] != '\0' ? ": " : "", self->why);
        return;
    }
    self->taken = false;
    self->again.pair.number =
        self->event.pair.number;  // the number in the session, not the instrument's
    for (int side = 0; side < RIG_SIDES; side++) {
        // Version 1 of the session format does not record how images were stored.
        self->again.pair.frame[side].has_picture = self->event.pair.frame[side].has_picture;
    }
    const int expected = session_event_print(&self->event, self->line[0]);
    const int came = session_event_print(&self->again, self->line[1]);
    INVARIANT(expected > 0 && came > 0);
    if (strcmp(self->line[0], self->line[1]) != 0) {
        diverge_in_pair(self);
        return;
    }
    self->outcome->pairs++;
}

/// Settings before the first command were applied by replay_profile.
static int refuse_late_setting(const struct play *self, struct message *message) {
    return self->up ? message_set(message, ERROR_SYNTAX, "%s: \"%.200s\" comes after a command",
                                  self->session.path, self->event.text)
                    : 0;
}

/// Replays one event. 0, or an error that ends the replay.
static int play_event(struct play *self, struct message *message) {
    switch (self->event.kind) {
        case SESSION_SETTING:
            return refuse_late_setting(self, message);
        case SESSION_COMMAND:
            run_command(self);
            break;
        case SESSION_PAIR:
            compare_pair(self);
            break;
        case SESSION_BEGIN:
        case SESSION_INSTRUMENT:
        case SESSION_CALIBRATION:
        case SESSION_REGISTERS:
        case SESSION_END:
        case SESSION_EVENT_KINDS:
            break;
    }
    return self->cancelled ? message_set(message, ERROR_CANCELLED, "cancelled") : 0;
}

/// Checks the whole index before anything is replayed.
static int peek(struct play *self, int parent, const char *path, struct message *message) {
    struct play_outcome *outcome = self->outcome;
    uint32_t commands = 0;
    int got = session_reader_open(&self->session, parent, path, &self->event, message);
    if (got != 0) {
        return got;
    }
    memcpy(outcome->build, self->event.build, sizeof outcome->build);
    memcpy(outcome->profile, self->event.profile, sizeof outcome->profile);
    while ((got = session_reader_next(&self->session, &self->event, message)) == 1) {
        commands += self->event.kind == SESSION_COMMAND;
    }
    outcome->cut = self->session.cut;
    session_reader_close(&self->session);
    if (got == 0 && commands == 0) {
        got =
            message_set(message, ERROR_MISSING,
                        "%s: contains no commands to replay (\"record start\" records them)", path);
    }
    return got;
}

static int open_all(struct play *self, int parent, const char *path, struct message *message) {
    int error = peek(self, parent, path, message);
    if (error == 0) {
        error = replay_open(&self->replay, parent, path, NULL, message);
    }
    if (error != 0) {
        return error;
    }
    if (self->replay.log == NULL) {
        return message_set(message, ERROR_MISSING,
                           "%s: contains no calls to replay (\"record start\" records them)", path);
    }
    self->calls = self->replay.calls;
    self->replay.cancel = cancel_command;
    self->replay.self = self;
    config_defaults(&self->config);
    self->config.backend = CONFIG_BACKEND_REPLAY;  // requires no devices
    error = replay_profile(parent, path, &self->config, message);
    return error != 0 ? error : session_reader_open(&self->session, parent, path, NULL, message);
}

/// Replays event by event, up to the end, the first difference or the end of a cut recording.
static int play_events(struct play *self, struct message *message) {
    int error = 0;
    int got = 1;
    const bool *const ran_out = &self->replay.ran_out;
    while (error == 0 && !differs(self) && !*ran_out &&
           (got = session_reader_next(&self->session, &self->event, message)) == 1) {
        error = play_event(self, message);
    }
    return error != 0 ? error : got < 0 ? got : 0;
}

static int play_all(struct play *self, struct message *message) {
    const int error = play_events(self, message);
    if (error != 0) {
        return error;
    }
    struct play_outcome *outcome = self->outcome;
    if (self->up && !self->replay.ended) {
        (void)rig_idle(&self->rig);
        look_for_error(self);
    }
    if (!differs(self) && !outcome->cut && !replay_is_over(&self->replay)) {
        diverge(self, "%s: the last %u recorded calls were not made", self->session.path,
                (unsigned)self->replay.calls);
    }
    outcome->calls = self->replay.made;
    outcome->same = !differs(self);
    if (outcome->same && outcome->commands == 0) {
        return message_set(message, ERROR_MISSING,
                           "%s: cut off before its first command was complete: nothing to compare",
                           self->session.path);
    }
    return 0;
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
    self->session.directory = self->replay.session.directory = -1;
    make_table(self);
    int error = open_all(self, parent, path, message);
    error = error != 0 ? error : play_all(self, message);
    session_reader_close(&self->session);
    replay_close(&self->replay);
    free(self);
    return error;
}

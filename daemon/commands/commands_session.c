// SPDX-License-Identifier: Apache-2.0
// Captures pairs and records sessions into the instrument's files. Used by the rig's thread only,
// which waits while the disk writer writes.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "console/pair/calibration_at.h"
#include "console/pair/capture.h"
#include "daemon/base/process.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/commands/space_check.h"
#include "daemon/session/session_write.h"
#include "daemon/settings/saved_lens.h"
#include "rig/pair.h"

enum { START, STOP, COMMAND_TEXT_BYTES = 128 };

/// Writes the saved calibration, if there is one, to a session. To one of all zooms, each pair adds
/// that of its own state.
static int write_calibration(const struct command_call *call, struct message *message) {
    const struct hal_store *store = daemon_of(call)->store;
    char *text = store == NULL ? NULL : malloc(STORE_CALIBRATION_BYTES);
    size_t length = 0;
    if (text == NULL) {
        return store == NULL ? 0 : message_set(message, ERROR_MEMORY, "out of memory");
    }
    int error = store->operations->load(store->self, STORE_CALIBRATION, text,
                                        STORE_CALIBRATION_BYTES, &length);
    if (error == ERROR_OK) {
        INVARIANT(length <= STORE_CALIBRATION_BYTES);
        struct session_writer *writer = &daemon_of(call)->session.writer;
        error = zoom_calibration_is_text(text, length)
                    ? session_writer_zoom_calibration(writer, text, length, message)
                    : session_writer_calibration(writer, text, length, message);
    } else {
        error = error == ERROR_MISSING
                    ? 0
                    : message_set(message, error, "the saved calibration cannot be read: %s",
                                  error_text(error));
    }
    free(text);
    return error;
}

/// Start of a session or of a pair, as a job for the disk writer.
struct beginning {
    const struct command_call *call;
    const struct command_value *name;
    const char *kind;
    bool add;                           // append to the session if it exists
    struct pair_instrument instrument;  // instrument of a new session
    struct captured_pair *captured;     // captured pair to be stored; NULL: none
    int error;
};

static void look_for_name(void *cookie) {
    struct beginning *self = cookie;
    struct message message;
    const int root = daemon_of(self->call)->files_fd;
    int error = 0;
    if (self->add && session_writer_exists(root, self->name->text)) {
        struct session_writer *writer = &daemon_of(self->call)->session.writer;
        error = session_writer_resume(writer, root, self->name->text, &message);
        session_writer_leave(writer);  // nothing is changed yet
    } else {
        error = session_writer_check(root, self->name->text, &message);
    }
    self->error =
        error == ERROR_OK ? ERROR_OK : command_fail(self->call, error, "%s", message.text);
}

/// Checks, before there is any data, that a session of this name can be started.
static int check_name(const struct command_call *call, const struct command_value *name, bool add) {
    struct beginning beginning = {.call = call, .name = name, .add = add};
    int error = files_need_directory(call);
    if (error != ERROR_OK || !name->given) {
        return error;
    }
    error = files_check_new(call, name->text);
    if (error == ERROR_OK) {
        disk_writer_run(&daemon_of(call)->disk_writer, look_for_name, &beginning);
    }
    return error != ERROR_OK ? error : beginning.error;
}

int commands_session_check_name(const struct command_call *call, const struct command_value *name) {
    return check_name(call, name, false);
}

static void write_beginning(void *cookie) {
    struct beginning *self = cookie;
    const struct command_call *call = self->call;
    struct daemon *daemon = daemon_of(call);
    struct session *session = &daemon->session;
    struct message message;
    const time_t now = time(NULL);
    struct tm parts;
    char date[32];
    if (self->name->given) {
        snprintf(session->name, sizeof session->name, "%s", self->name->text);
    } else {
        files_name_now(call, self->kind, "", session->name);
    }
    gmtime_r(&now, &parts);
    strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", &parts);
    const bool add = self->add && session_writer_exists(daemon->files_fd, session->name);
    int error =
        add ? session_writer_resume(&session->writer, daemon->files_fd, session->name, &message)
            : session_writer_begin(&session->writer, daemon->files_fd, session->name,
                                   version_build_id(), call->rig->profile.name, date, &message);
    if (error == ERROR_OK) {
        session->writer.free_bytes = space_check_now(daemon).files_bytes;
        error = session_writer_instrument(&session->writer, &self->instrument, &message);
        // A saved one that the pair was taken without, since it cannot be read, is left out.
        const bool left_out = self->captured != NULL && self->captured->calibration_length == 0;
        error = error != ERROR_OK || left_out ? error : write_calibration(call, &message);
        if (error != ERROR_OK) {
            session_writer_discard(&session->writer, daemon->files_fd);
        }
    }
    self->error = error == ERROR_OK ? ERROR_OK : command_fail(call, error, "%s", message.text);
}

/// Starts a session, or continues it; only after `check_name`.
static int begin_session(const struct command_call *call, const struct command_value *name,
                         const char *kind, bool add, struct captured_pair *captured) {
    struct beginning beginning = {
        .call = call, .name = name, .kind = kind, .add = add, .captured = captured};
    commands_calibration_instrument(call, &beginning.instrument);
    disk_writer_run(&daemon_of(call)->disk_writer, write_beginning, &beginning);
    return beginning.error;
}

/// A write to the session, as a job for the disk writer, and its outcome.
struct writing {
    struct session *session;
    const struct captured_pair *captured;
    const struct registers_all *registers;
    const char *command;
    int files_fd;
    int error;
    struct message message;
};

/// Writes a pair with its register values, and its calibration if it has one of its own.
static int write_with_registers(struct writing *self) {
    struct session *session = self->session;
    int error = 0;
    for (size_t i = 0; error == ERROR_OK && i < self->registers->count; i++) {
        const struct registers_run *run = &self->registers->run[i];
        error = session_writer_registers(&session->writer, rig_part_text(run->part), run->at_us,
                                         run->first, run->values, run->count, &self->message);
    }
    if (error == ERROR_OK && self->captured->calibration_own) {
        error = session_writer_calibration(&session->writer, self->captured->calibration,
                                           self->captured->calibration_length, &self->message);
    }
    return error != ERROR_OK
               ? error
               : session_writer_pair(&session->writer, &self->captured->pair, &self->message);
}

/// Writes and ends a session of one pair; discards it on failure.
static void write_whole(void *cookie) {
    struct writing *self = cookie;
    struct session *session = self->session;
    int error = session_writer_command(&session->writer, self->command, &self->message);
    if (error == ERROR_OK) {
        error = write_with_registers(self);
    }
    if (error == ERROR_OK) {
        error = session_writer_end(&session->writer, &self->message);
    } else {
        session_writer_discard(&session->writer, self->files_fd);
    }
    self->error = error;
}

static void write_pair(void *cookie) {
    struct writing *self = cookie;
    self->error = write_with_registers(self);
}

/// The command that took the pair, as far as it is of interest in its own session.
static void write_command(const struct command_call *call, char text[COMMAND_TEXT_BYTES]) {
    const struct pair_options options = capture_options(call->values, NULL);
    const unsigned frames = options.average != 0 ? options.average : options.bracket;
    const int length =
        snprintf(text, COMMAND_TEXT_BYTES, "capture%s",
                 command_is_set(&call->values[CAPTURE_ACCEPT]) ? " " CAPTURE_ACCEPT_WORD : "");
    INVARIANT(length > 0 && length < COMMAND_TEXT_BYTES / 2);
    if (frames != 0) {
        snprintf(text + length, COMMAND_TEXT_BYTES - (size_t)length, " %s=%u",
                 options.average != 0 ? "average" : "bracket", frames);
    }
    if (options.readings != 0) {
        const size_t used = strlen(text);
        snprintf(text + used, COMMAND_TEXT_BYTES - used, " readings=%u", options.readings);
    }
}

/// Writes a pair into its session; in a recording, after all calls that led to it.
static int save_pair(const struct command_call *call, const struct captured_pair *captured,
                     const struct registers_all *registers) {
    struct session *session = &daemon_of(call)->session;
    struct daemon *daemon = daemon_of(call);
    char command[COMMAND_TEXT_BYTES];
    write_command(call, command);
    struct writing writing = {.session = session,
                              .captured = captured,
                              .registers = registers,
                              .command = command,
                              .files_fd = daemon->files_fd};
    if (session->recording) {
        writing.error = record_flush(&daemon->record, &writing.message);
    }
    if (writing.error == ERROR_OK) {
        disk_writer_run(&daemon->disk_writer, session->recording ? write_pair : write_whole,
                        &writing);
    }
    return writing.error == ERROR_OK
               ? 0
               : command_fail(call, writing.error, "%s", writing.message.text);
}

static void set_name(void *cookie) {
    struct beginning *self = cookie;
    files_name_now(self->call, self->kind, "", self->captured->name);
}

/// Fills in what a reconstruction needs besides images and calibration.
static void describe(const struct command_call *call, struct captured_pair *captured) {
    _Static_assert(sizeof captured->name > FILES_NAME_MAX, "a session's name fits");
    struct beginning beginning = {.call = call, .kind = "capture", .captured = captured};
    snprintf(captured->profile, sizeof captured->profile, "%s", call->rig->profile.name);
    captured->has_instrument = true;
    commands_calibration_instrument(call, &captured->instrument);
    disk_writer_run(&daemon_of(call)->disk_writer, set_name, &beginning);
}

/// Writes the pair to disk if a session was asked for.
static int write_session(const struct command_call *call, struct captured_pair *captured,
                         const struct registers_all *registers) {
    struct session *session = &daemon_of(call)->session;
    if (!session->recording && !call->values[CAPTURE_NAME].given) {
        return ERROR_OK;
    }
    int error = session->recording
                    ? 0
                    : begin_session(call, &call->values[CAPTURE_NAME], "capture",
                                    command_is_set(&call->values[CAPTURE_ADD]), captured);
    error = error != ERROR_OK ? error : save_pair(call, captured, registers);
    if (error == ERROR_OK) {
        captured->in_session = true;
        snprintf(captured->name, sizeof captured->name, "%s", session->name);
        // Its number in the session, as for "reconstruct", not the rig's count.
        captured->pair.number = session->writer.pairs;
    }
    return error;
}

/// Takes a pair into `captured`. `*kept`: it is the last pair now.
static int take_pair(const struct command_call *call, const struct pair_options *options,
                     struct captured_pair *captured, bool *kept) {
    struct session *session = &daemon_of(call)->session;
    struct registers_all registers;
    int error = capture_take(call->rig, options, &captured->pair, &registers);
    if (error != ERROR_OK) {
        return error;
    }
    describe(call, captured);
    const int mismatch =
        commands_calibration_of_pair(call, captured, command_is_set(&call->values[CAPTURE_ACCEPT]));
    error = session->recording ? 0 : mismatch;
    error = error != ERROR_OK ? error : write_session(call, captured, &registers);
    if (error != ERROR_OK) {
        pair_release(captured->pair.frame);
        return error;
    }
    if (captured->in_session) {
        reply_text(call, "session", captured->name);
    }
    capture_reply(call, &captured->pair);
    *kept = true;
    last_pair_set(&daemon_of(call)->last_pair, captured);
    return mismatch;
}

static int run_capture(const struct command_call *call) {
    struct session *session = &daemon_of(call)->session;
    static const struct pair_memory memory = {malloc, free};
    const struct pair_options options = capture_options(call->values, &memory);
    const bool named = call->values[CAPTURE_NAME].given;
    if (session->recording && named) {
        return command_fail(call, ERROR_ARGUMENT,
                            "capture: NAME is not allowed while recording %s (omit it)",
                            session->name);
    }
    if (call->values[CAPTURE_AVERAGE].given && call->values[CAPTURE_BRACKET].given) {
        return command_fail(call, ERROR_ARGUMENT,
                            "capture: average and bracket exclude each other (omit one)");
    }
    const bool add = command_is_set(&call->values[CAPTURE_ADD]);
    int error = ERROR_OK;
    if (named) {
        error = check_name(call, &call->values[CAPTURE_NAME], add);
    } else if (add) {
        error = command_fail(call, ERROR_ARGUMENT, "capture: add needs the session's NAME");
    }
    error = error != ERROR_OK ? error : space_check_pair(call, &options, named);
    if (error != ERROR_OK) {
        return error;
    }
    struct captured_pair *captured = calloc(1, sizeof *captured);
    bool kept = false;
    error = captured != NULL ? take_pair(call, &options, captured, &kept) : ERROR_MEMORY;
    if (!kept) {
        free(captured);
    }
    return error != ERROR_MEMORY
               ? error
               : command_fail(call, error, "capture: out of memory for its frames");
}

/// Logs a state of the recording: "the recording r1 begins".
static void report(struct daemon *daemon, const char *what) {
    log_ring_print(&daemon->log_ring, HAL_LOG_NOTICE, "the recording %s %s", daemon->session.name,
                   what);
}

/// Resets the rig to its state after the daemon's start, in which a replay starts too.
static void begin_afresh(struct rig *rig) {
    const struct rig_profile profile = rig->profile;
    const struct rig_ports ports = rig->ports;
    const struct rig_observer observer = rig->observer;
    if (rig->state != RIG_DOWN) {
        rig_safe(rig);
    }
    rig_init(rig, &profile, &ports, &observer);
}

/// Gives the recording what was learned about the lenses before, as commands: a replay starts
/// without.
static int give_learned(const struct command_call *call, const struct saved_lenses *learned) {
    char lines[SAVED_LENS_LINES][SAVED_LENS_LINE_BYTES];
    const size_t count = saved_lens_commands(learned, call->rig, true, lines, 0);
    int error = 0;
    for (size_t i = 0; i < count && error == ERROR_OK; i++) {
        error = command_give(call, lines[i], NULL);
    }
    return error;
}

/// Writes the profile that the instrument is based on, if its name differs, and the settings that
/// differ from that profile: a replay has neither the configuration nor the profile's file.
static int write_settings(const struct command_call *call, struct message *message) {
    struct session *session = &daemon_of(call)->session;
    const struct config *config = &daemon_of(call)->config;
    const bool named = strcmp(config->profile.name, config->like) == 0;
    struct config defaults;
    config_defaults(&defaults);
    int error = config_set(&defaults, CONFIG_PROFILE_KEY, config->like, message);
    INVARIANT(error == ERROR_OK);
    if (!named) {
        error = session_writer_setting(&session->writer, CONFIG_PROFILE_KEY, config->like, message);
    }
    for (size_t i = 0; error == ERROR_OK && i < config_key_count(); i++) {
        char value[CONFIG_TEXT_BYTES + 16];
        char before[CONFIG_TEXT_BYTES + 16];
        config_key_print(config, i, value, sizeof value);
        config_key_print(&defaults, i, before, sizeof before);
        if (config_key_is_of_rig(i) && strcmp(value, before) != 0) {
            error = session_writer_setting(&session->writer, config_key_name(i), value, message);
            // A key may set others too, which then need not be written.
            error = error != ERROR_OK ? error
                                      : config_set(&defaults, config_key_name(i), value, message);
        }
    }
    return error;
}

static int start_recording(const struct command_call *call) {
    struct session *session = &daemon_of(call)->session;
    struct message message;
    if (session->recording) {
        return command_fail(call, ERROR_BUSY, "record: already recording %s", session->name);
    }
    int error = check_name(call, &call->values[1], false);
    error = error != ERROR_OK ? error : space_check_recording(call);
    error =
        error != ERROR_OK ? error : begin_session(call, &call->values[1], "record", false, NULL);
    if (error != ERROR_OK) {
        return error;
    }
    struct saved_lenses learned;
    saved_lens_take(call->rig, &learned);
    begin_afresh(call->rig);
    error = write_settings(call, &message);
    error = error != ERROR_OK ? error
                              : record_start(&daemon_of(call)->record, &session->writer, &message);
    if (error != ERROR_OK) {
        session_writer_discard(&session->writer, daemon_of(call)->files_fd);
        return command_fail(call, error, "%s", message.text);
    }
    session->recording = true;
    report(daemon_of(call), "begins");
    reply_text(call, "session", session->name);
    return give_learned(call, &learned);
}

static void write_end(void *cookie) {
    struct writing *self = cookie;
    self->error = session_writer_end(&self->session->writer, &self->message);
}

/// Ends a recording. An incomplete one gets no end record, so that readers detect it.
static int stop_recording(struct daemon *daemon, struct message *message) {
    struct session *session = &daemon->session;
    struct writing end = {.session = session};
    end.error = record_stop(&daemon->record, &end.message);
    session->recording = false;
    if (end.error != ERROR_OK) {
        session_writer_leave(&session->writer);
        return message_set(message, end.error, "%.900s; the recording is cut off there",
                           end.message.text);
    }
    disk_writer_run(&daemon->disk_writer, write_end, &end);
    if (end.error == ERROR_OK) {
        report(daemon, "has ended");
    }
    *message = end.message;
    return end.error;
}

void commands_session_put_state(const struct command_call *call) {
    struct session *session = &daemon_of(call)->session;
    const char *cut = record_cut(&daemon_of(call)->record);
    if (!session->recording) {
        return;
    }
    reply_text(call, "recording", session->name);
    if (cut != NULL) {
        reply_text(call, "cut_off", cut);
    }
}

static int run_record(const struct command_call *call) {
    struct session *session = &daemon_of(call)->session;
    struct message message;
    if (!call->values[0].given) {
        commands_session_put_state(call);
        if (!session->recording) {
            reply_text(call, "recording", "nothing");
        }
        return ERROR_OK;
    }
    if (call->values[0].choice == START) {
        return start_recording(call);
    }
    if (call->values[1].given) {
        return command_fail(call, ERROR_ARGUMENT, "record: NAME \"%s\" is only for \"start\"",
                            call->values[1].text);
    }
    if (!session->recording) {
        return command_fail(call, ERROR_ARGUMENT, "record: not recording");
    }
    reply_text(call, "session", session->name);
    reply_number(call, "pairs", session->writer.pairs, 0, NULL);
    const int error = stop_recording(daemon_of(call), &message);
    return error == ERROR_OK ? ERROR_OK : command_fail(call, error, "%s", message.text);
}

/// A note for a session, as a job for the disk writer.
struct note {
    int files_fd;
    const char *name, *text;
    int error;
    struct message message;
};

static void write_note(void *cookie) {
    struct note *self = cookie;
    self->error = session_add_note(self->files_fd, self->name, self->text, &self->message);
}

int commands_session_note(const struct command_call *call, const char *name, const char *text) {
    struct daemon *daemon = daemon_of(call);
    struct note note = {.files_fd = daemon->files_fd, .name = name, .text = text};
    INVARIANT(text[0] == '#' && strlen(text) <= SESSION_TEXT_MAX);
    if (daemon->session.recording) {
        record_command(&daemon->record, text);
        record_command_end(&daemon->record, ERROR_OK);
        return ERROR_OK;  // a disk that is full cuts the recording off there
    }
    disk_writer_run(&daemon->disk_writer, write_note, &note);
    return note.error == ERROR_OK ? ERROR_OK
                                  : command_fail(call, note.error, "%s", note.message.text);
}

void commands_session_end(struct daemon *daemon) {
    struct session *session = &daemon->session;
    struct message message;
    if (session->recording && stop_recording(daemon, &message) != 0) {
        log_ring_print(&daemon->log_ring, HAL_LOG_ERROR, "%s", message.text);
    }
}

static const struct command_argument record_arguments[] = {
    {.name = "WHAT",
     .kind = COMMAND_CHOICE,
     .choices = "start stop",
     .optional = true,
     .help = "what to do; default: show the current recording"},
    {.name = "NAME",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 60,
     .optional = true,
     .help = "of the new session: letters, digits and - _ . + = , @; default: date and time"},
};

static const struct command commands[] = {
    {.name = "capture",
     .summary = "capture a pair of frames",
     .help = "Keeps the pair in memory for \"reconstruct\" until the next capture or the daemon's "
             "end. With NAME it also writes it to a new session (add=yes: or an existing one) in "
             "\"files\", during a recording "
             "to that. Fails if something moved between the frames, or if the saved calibration is "
             "for other axes, cameras or windows. Reports for each side brightness (mean, of full "
             "scale), saturated and black pixels, and sharpness (of the steepest possible edges). "
             "\"average\" and \"bracket\" merge several frames of a scene at rest into one of 16 "
             "bits with less noise, left camera first (brackets: behind a bridge only). A bracket "
             "begins with the present exposure, shorter if 0.3 % is saturated, and grows by 2 to 8 "
             "times until dark parts have an eighth of the range. Where lamps flicker the exposure "
             "should be a multiple of half the mains period.",
     .arguments = capture_arguments,
     .argument_count = CAPTURE_ARGUMENTS,
     .flags =
         COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_MEASURE | COMMAND_DAILY,
     .run = run_capture},
    {.name = "record",
     .summary = "record everything that the hardware does, for replay",
     .help =
         "Records commands, calls of buses, GPIO lines, cameras and clock, and pairs. \"start\" "
         "takes the instrument down first. \"replay SESSION\" replays it. A full disk cuts it "
         "off, which \"record\" and \"status\" report.",
     .arguments = record_arguments,
     .argument_count = 2,
     .flags = COMMAND_MOVES | COMMAND_UNRECORDED | COMMAND_GROUP_MEASURE,
     .run = run_record},
};

const struct command *commands_session_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}

// SPDX-License-Identifier: Apache-2.0
// The saved calibration of the instrument: show, set from a file, forget.
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "console/pair/calibration_reply.h"
#include "console/pair/capture.h"
#include "core/crc.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/session/calibration_read.h"
#include "daemon/surface/length_check.h"
#include "stereo/geometry/calibration.h"
#include "stereo/zoom/adjust_pair.h"

enum { SHOW, SET, FORGET };
enum { WHAT, FILE_NAME, ACCEPT, UNIT, ARGUMENTS };

_Static_assert((int)STORE_CALIBRATION_BYTES == (int)CALIBRATION_AT_TEXT_BYTES,
               "the buffers fit the longest calibration");

// ---- the record

/// The text of a calibration; one more byte detects a longer file. Allocated, as it may be large.
struct calibration_text {
    char data[STORE_CALIBRATION_BYTES + 1];
    size_t length;
};

static int load_text(const struct command_call *call, struct calibration_text *text) {
    return commands_store_load(call, STORE_CALIBRATION, text->data, STORE_CALIBRATION_BYTES,
                               &text->length);
}

/// The saved text, to be freed; NULL with ERROR_MISSING: none is saved, or with another error.
static struct calibration_text *load_saved(const struct command_call *call, int *error) {
    struct calibration_text *text = NULL;
    *error = daemon_of(call)->store == NULL ? ERROR_MISSING : ERROR_OK;
    if (*error == ERROR_OK) {
        text = malloc(sizeof *text);
        *error = text == NULL ? ERROR_MEMORY : load_text(call, text);
    }
    if (*error != ERROR_OK) {
        free(text);
        text = NULL;
    }
    return text;
}

// ---- the mismatch that was accepted

/// The checksum of the calibration that was set with accept-mismatch=yes: it stays usable with an
/// instrument and cameras that it was not made with.
#define STORE_ACCEPTED "accepted"
enum { ACCEPTED_BYTES = 8 };

static void print_accepted(const struct calibration_text *text, char accepted[ACCEPTED_BYTES + 1]) {
    snprintf(accepted, ACCEPTED_BYTES + 1, "%08" PRIx32, crc_update(0, text->data, text->length));
}

static bool is_accepted(const struct command_call *call, const struct calibration_text *text) {
    char wanted[ACCEPTED_BYTES + 1], found[ACCEPTED_BYTES];
    size_t length = 0;
    print_accepted(text, wanted);
    return commands_store_load(call, STORE_ACCEPTED, found, sizeof found, &length) == ERROR_OK &&
           length == ACCEPTED_BYTES && memcmp(found, wanted, ACCEPTED_BYTES) == 0;
}

static int save_accepted(const struct command_call *call, const struct calibration_text *text,
                         bool accepted) {
    char wanted[ACCEPTED_BYTES + 1];
    print_accepted(text, wanted);
    if (accepted) {
        return commands_store_save(call, STORE_ACCEPTED, wanted, ACCEPTED_BYTES);
    }
    return is_accepted(call, text) ? commands_store_remove(call, STORE_ACCEPTED) : ERROR_OK;
}

/// calibration_match with the saved calibration of this text: another instrument and other cameras
/// that were accepted do not count, and the answer names them.
static int match_saved(const struct command_call *call, const struct calibration_text *text,
                       const struct calibration *calibration,
                       const struct calibration_match_state *state, const char *accept,
                       struct message *message) {
    const int error = calibration_match(calibration, state, accept, message);
    if (error != ERROR_MISMATCH || !calibration->has_origin || !is_accepted(call, text)) {
        return error;
    }
    struct calibration_match_state assumed = *state;
    calibration_match_assume(calibration, &assumed);
    const int rest = calibration_match(calibration, &assumed, accept, message);
    if (rest == ERROR_OK) {
        (void)calibration_match(calibration, state, NULL, message);
        reply_text(call, "accepted_mismatch", message->text);
    }
    return rest;
}

/// A read of a file as a job for the disk writer.
struct reading {
    const struct command_call *call;
    const char *name;
    struct calibration_text *text;
    int error;
};

static int read_text(struct reading *self) {
    const int fd = files_open(self->call, self->name);
    if (fd < 0) {
        return fd;
    }
    const ssize_t length = read(fd, self->text->data, sizeof self->text->data);
    close(fd);
    if (length < 0 || length > STORE_CALIBRATION_BYTES) {
        return command_fail(self->call, ERROR_SYNTAX, "%s: not a calibration file of Vergence",
                            self->name);
    }
    self->text->length = (size_t)length;
    return ERROR_OK;
}

static void read_job(void *cookie) {
    struct reading *self = cookie;
    self->error = read_text(self);
}

// ---- match with the instrument

void commands_calibration_instrument(const struct command_call *call,
                                     struct pair_instrument *instrument) {
    const struct rig_devices *devices = call->rig->ports.devices;
    *instrument = calibration_match_instrument(&call->rig->profile);
    for (int side = 0; side < RIG_SIDES; side++) {
        const enum rig_part part = side == RIG_LEFT ? RIG_PART_LEFT_CAMERA : RIG_PART_RIGHT_CAMERA;
        const char *identity = devices != NULL && devices->identity != NULL
                                   ? devices->identity(devices->self, part)
                                   : NULL;
        snprintf(instrument->camera[side], sizeof instrument->camera[side], "%s",
                 identity != NULL ? identity : "");
    }
}

/// Sets the calibration of a pair from the saved text and compares it with the pair's axes.
static int use_saved(const struct command_call *call, const struct calibration_text *text,
                     const struct calibration_match_state *state, const char *accept,
                     struct captured_pair *captured, struct message *message) {
    struct calibration calibration;
    const int error = calibration_read_for_pair("the saved calibration", text->data, text->length,
                                                state, &calibration, message);
    if (error != ERROR_OK) {
        return error;
    }
    const int length =
        calibration_print(&calibration, captured->calibration, sizeof captured->calibration);
    INVARIANT(length > 0);
    captured->calibration_length = (size_t)length;
    captured->calibration_own = zoom_calibration_is_text(text->data, text->length);
    return match_saved(call, text, &calibration, state, accept, message);
}

static bool has_open_play(const struct rig *rig, unsigned side, enum lens_axis axis) {
    return rig_has_axis(&rig->profile, side, axis) &&
           rig->profile.lens.axis[axis].backlash_counts > 0 &&
           rig->camera[side].lens.commanded[axis] == INT32_MIN;
}

/// A ring is where a calibration of all zooms expects it only after a move, which takes up the
/// play.
static void say_open_play(const struct command_call *call) {
    for (unsigned i = 0; i < 2 * RIG_SIDES; i++) {
        const enum lens_axis axis = i % 2 == 0 ? LENS_ZOOM : LENS_FOCUS;
        if (!has_open_play(call->rig, i / 2, axis)) {
            continue;
        }
        struct message message;
        (void)message_set(&message, 0,
                          "%s %s was not driven since the bring-up, and may be off by the play of "
                          "its gear, %d counts: %s N drives it",
                          rig_side_names[i / 2], lens_axis_names[axis],
                          (int)call->rig->profile.lens.axis[axis].backlash_counts,
                          lens_axis_names[axis]);
        reply_text(call, "note", message.text);
        return;
    }
}

int commands_calibration_of_pair(const struct command_call *call, struct captured_pair *captured,
                                 bool accepted) {
    struct calibration_match_state state;
    struct message message;
    int error;
    captured->calibration_length = 0;
    struct calibration_text *text = load_saved(call, &error);
    if (text == NULL && error == ERROR_MISSING) {
        return ERROR_OK;
    }
    if (text == NULL) {
        (void)message_set(&message, error, "the saved calibration cannot be read: %s",
                          error_text(error));
    } else {
        calibration_match_pair(call->rig->profile.name, &captured->instrument, &captured->pair,
                               &state);
        error = use_saved(call, text, &state, accepted ? NULL : CAPTURE_ACCEPT_WORD, captured,
                          &message);
    }
    free(text);
    if (error != ERROR_OK && error != ERROR_MEMORY && accepted) {
        // One that cannot be used at all is left out.
        captured->calibration_length = error == ERROR_MISMATCH ? captured->calibration_length : 0;
        reply_text(call, "accepted_mismatch", message.text);
        return ERROR_OK;
    }
    if (error != ERROR_OK) {
        return command_fail(call, error, "%s", message.text);
    }
    if (captured->calibration_own) {
        say_open_play(call);
    }
    return ERROR_OK;
}

void commands_calibration_now(const struct command_call *call,
                              struct calibration_match_state *state) {
    struct pair_instrument instrument;
    commands_calibration_instrument(call, &instrument);
    calibration_match_now(call->rig, &instrument, state);
}

int commands_calibration_saved(const struct command_call *call,
                               const struct calibration_match_state *state,
                               struct calibration *calibration, struct message *message) {
    int error;
    struct calibration_text *text = load_saved(call, &error);
    if (text == NULL) {
        return message_set(message, error, "%s",
                           error == ERROR_MISSING
                               ? "no calibration is saved (\"calibration set FILE\")"
                               : error_text(error));
    }
    error = calibration_read_for_pair("the saved calibration", text->data, text->length, state,
                                      calibration, message);
    error = error == ERROR_OK ? match_saved(call, text, calibration, state, NULL, message) : error;
    free(text);
    return error == ERROR_SIZE_MISMATCH ? ERROR_OK : error;
}

/// Reads the lens positions, which may have changed since they were last read. Not while recording:
/// these calls belong to a command that a recording does not contain.
static int read_lenses(const struct command_call *call) {
    int error = 0;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        int32_t positions[LENS_AXES];
        if (call->rig->camera[side].lens.drive.controller != NULL &&
            !record_is_under_way(&daemon_of(call)->record)) {
            error = rig_lens_read(call->rig, side, positions);
        }
    }
    return error;
}

/// What a calibration of all zooms says of its instrument and cameras.
static void take_rig(const struct zoom_calibration *zoom, struct calibration *of_rig) {
    memset(of_rig, 0, sizeof *of_rig);
    of_rig->has_origin = true;
    memcpy(of_rig->origin.instrument, zoom->instrument, sizeof zoom->instrument);
    for (int side = 0; side < RIG_SIDES; side++) {
        memcpy(of_rig->origin.side[side].camera, zoom->camera[side].name,
               sizeof zoom->camera[side].name);
    }
}

/// The same of a text, of one state or of all zooms.
static int read_rig(const struct calibration_text *text, struct calibration *of_rig,
                    struct message *message) {
    static const char name[] = "the saved calibration";
    struct zoom_calibration *zoom = NULL;
    if (!zoom_calibration_is_text(text->data, text->length)) {
        struct calibration_match_state state = {.width_px = {0}};
        const int error = calibration_at(name, text->data, text->length, of_rig, message);
        calibration_match_assume(of_rig, &state);
        of_rig->origin = state.origin;
        return error;
    }
    const int error = calibration_read_zoom(name, text->data, text->length, &zoom, message);
    if (error == ERROR_OK) {
        take_rig(zoom, of_rig);
        free(zoom);
    }
    return error;
}

int commands_calibration_check_rig(const struct command_call *call, bool *accepted) {
    struct calibration_match_state state;
    struct calibration of_rig;
    struct message message;
    int error;
    struct calibration_text *text = load_saved(call, &error);
    if (text == NULL || call->rig->state != RIG_READY) {
        free(text);
        return error;
    }
    error = read_rig(text, &of_rig, &message);
    if (error != ERROR_OK) {
        free(text);
        return command_fail(call, error, "%s", message.text);
    }
    commands_calibration_now(call, &state);
    const bool fits = calibration_match(&of_rig, &state, NULL, &message) != ERROR_MISMATCH;
    const bool usable = fits || is_accepted(call, text);
    free(text);
    if (!usable) {
        return command_fail(call, ERROR_MISMATCH,
                            "%s (\"calibration set\" that of this one, or accept it with "
                            "\"calibration set FILE " CAPTURE_ACCEPT_WORD "\")",
                            message.text);
    }
    if (!fits && !*accepted) {
        *accepted = true;
        reply_text(call, "accepted_mismatch", message.text);
    }
    return ERROR_OK;
}

int commands_calibration_zoom(const struct command_call *call, struct zoom_calibration **zoom,
                              bool *accepted) {
    struct message message;
    int error;
    struct calibration_text *text = load_saved(call, &error);
    if (text == NULL && error != ERROR_MISSING) {
        return command_fail_store(call, error, "calibration", "read from");
    }
    if (text == NULL || !zoom_calibration_is_text(text->data, text->length)) {
        free(text);
        return command_fail(call, ERROR_MISSING,
                            "this needs a calibration of all zooms, none is saved (\"calibration "
                            "set instrument.zoom\" first)");
    }
    error =
        calibration_read_zoom("the saved calibration", text->data, text->length, zoom, &message);
    free(text);
    if (error != ERROR_OK) {
        return command_fail(call, error, "%s", message.text);
    }
    error = commands_calibration_check_rig(call, accepted);
    if (error != ERROR_OK) {
        free(*zoom);
        *zoom = NULL;
    }
    return error;
}

/// The identifier of a text, which need not be valid otherwise.
static bool find_id(const struct calibration_text *text, char id[CALIBRATION_ID_BYTES]) {
    static const char word[] = "\nid ";
    for (size_t i = 0; i + sizeof word < text->length && i < CALIBRATION_ID_BYTES; i++) {
        if (memcmp(&text->data[i], word, sizeof word - 1) == 0) {
            const char *begin = &text->data[i + sizeof word - 1];
            const char *end = memchr(begin, '\n', text->length - (size_t)(begin - text->data));
            if (end == NULL || end - begin >= CALIBRATION_ID_BYTES) {
                return false;
            }
            snprintf(id, CALIBRATION_ID_BYTES, "%.*s", (int)(end - begin), begin);
            return true;
        }
    }
    return false;
}

/// Adds whether the saved calibration matches the instrument as it stands, and why not.
static void put_match(const struct command_call *call, const struct calibration_text *text) {
    struct calibration_match_state state;
    struct calibration calibration;
    struct message message;
    commands_calibration_now(call, &state);
    int error = calibration_read_for_pair(STORE_CALIBRATION, text->data, text->length, &state,
                                          &calibration, &message);
    if (error == ERROR_OK) {
        error = calibration_match(&calibration, &state, CAPTURE_ACCEPT_WORD, &message);
    }
    if (error != ERROR_OK) {
        reply_text(call, "match", "no");
        reply_text(call, "mismatch", message.text);
        return;
    }
    const bool partial = calibration_match_is_partial(&calibration, &state.origin);
    reply_text(call, "match", partial ? "not known" : "yes");
}

/// Adds how well it fits: by the last pair that it was adjusted by, and since when it holds.
static void put_health(const struct command_call *call) {
    struct daemon_health *health = &daemon_of(call)->health;
    const int64_t set_s = atomic_load(&health->set_s);
    const int64_t age_s = (int64_t)time(NULL) - set_s;
    reply_group_begin(call, "health", false);
    if (atomic_load(&health->is_adjusted)) {
        reply_text(call, "says", atomic_load(&health->word));
        reply_number(call, "rows", atomic_load(&health->rows_milli_px) / 1e3, 3, "px");
        reply_number(call, "depth_sigma", atomic_load(&health->depth_sigma_um) / 1e3, 3, "mm");
        reply_number(call, "depth", atomic_load(&health->depth_um) / 1e3, 1, "mm");
    } else {
        reply_text(call, "says", "not known");
    }
    reply_number(call, "moves", atomic_load(&health->moves), 0, NULL);
    if (set_s > 0 && age_s >= 0) {  // else the clock was not set
        reply_number(call, "hours", (double)age_s / 3600, 1, "h");
    }
    reply_group_end(call);
}

void commands_calibration_adjusted(const struct command_call *call,
                                   const struct adjust_report *report) {
    struct daemon_health *health = &daemon_of(call)->health;
    atomic_store(&health->word, adjust_health_text(report->health));
    atomic_store(&health->rows_milli_px, (uint32_t)(1e3 * report->rows_px + 0.5));
    atomic_store(&health->depth_sigma_um, (uint32_t)(1e3 * report->depth.after + 0.5));
    atomic_store(&health->depth_um, (uint32_t)(1e3 * report->depth_mm + 0.5));
    atomic_store(&health->is_adjusted, true);
}

/// A calibration was set: nothing has happened since.
static void reset_health(const struct command_call *call) {
    struct daemon_health *health = &daemon_of(call)->health;
    atomic_store(&health->is_adjusted, false);
    atomic_store(&health->moves, 0);
    atomic_store(&health->set_s, (int64_t)time(NULL));
}

void commands_calibration_put_state(const struct command_call *call) {
    char id[CALIBRATION_ID_BYTES];
    int error;
    struct calibration_text *text = load_saved(call, &error);
    if (text == NULL || !find_id(text, id)) {
        free(text);
        return;  // the command "calibration" reports it
    }
    reply_group_begin(call, "calibration", false);
    reply_text(call, "id", id);
    if (call->rig->state == RIG_READY) {
        put_match(call, text);
    }
    reply_group_end(call);
    put_health(call);
    free(text);
}

// ---- the command

/// Parses and shows a text, of one state or of all zooms.
static int show_text(const struct command_call *call, const char *name,
                     const struct calibration_text *text) {
    struct calibration calibration;
    struct zoom_calibration *zoom;
    struct message message;
    int error;
    if (zoom_calibration_is_text(text->data, text->length)) {
        error = calibration_read_zoom(name, text->data, text->length, &zoom, &message);
        if (error == ERROR_OK) {
            calibration_reply_put_zoom(call, zoom);
            free(zoom);
        }
    } else {
        error = calibration_at(name, text->data, text->length, &calibration, &message);
        if (error == ERROR_OK) {
            calibration_reply_put(call, &calibration);
        }
    }
    return error == ERROR_OK ? ERROR_OK : command_fail(call, error, "%s", message.text);
}

static int run_show(const struct command_call *call) {
    int error;
    struct calibration_text *text = load_saved(call, &error);
    if (error == ERROR_MISSING) {
        return command_fail(call, error,
                            "calibration: none saved (\"calibration set FILE\" first)");
    }
    if (text == NULL) {
        return command_fail_store(call, error, "calibration", "read from");
    }
    error = show_text(call, STORE_CALIBRATION, text);
    free(text);
    return error;
}

/// Rejects a calibration of another instrument or of other axis positions, unless accepted.
static int check_match(const struct command_call *call, const struct calibration *calibration,
                       bool accepted) {
    struct calibration_match_state state;
    struct message message;
    if (call->rig->state != RIG_READY) {
        return ERROR_OK;
    }
    int error = read_lenses(call);
    if (error != ERROR_OK) {
        return error;
    }
    commands_calibration_now(call, &state);
    error = calibration_match(calibration, &state, accepted ? NULL : CAPTURE_ACCEPT_WORD, &message);
    if (error == ERROR_SIZE_MISMATCH) {
        return ERROR_OK;  // the window may be set later, and a calibration of all zooms is cut to
                          // any
    }
    if (error == ERROR_MISMATCH && accepted) {
        reply_text(call, "accepted_mismatch", message.text);
        return ERROR_OK;
    }
    return error == ERROR_OK ? ERROR_OK : command_fail(call, error, "%s", message.text);
}

/// Records cameras, windows and axes as they are now in a calibration that states none, as those
/// of other programs, so that a later move is noticed. Returns 0 also where nothing is known.
static int record_axes(const struct command_call *call, struct calibration *calibration,
                       struct calibration_text *text, bool *recorded) {
    static const char note[] = "axes: where they were when it was set, not when it was made";
    struct calibration_match_state state;
    if (calibration->has_origin || call->rig->state != RIG_READY) {
        return ERROR_OK;
    }
    commands_calibration_now(call, &state);
    calibration->has_origin = true;
    calibration->origin = state.origin;
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct lens *lens = side == RIG_LEFT ? &calibration->left : &calibration->right;
        if (lens->width_px != state.width_px[side] || lens->height_px != state.height_px[side]) {
            calibration->origin.side[side].window = (struct calibration_window){0};  // not its own
        }
    }
    const size_t used = strlen(calibration->note);
    if (used + sizeof note + 2 <= sizeof calibration->note) {
        snprintf(calibration->note + used, sizeof calibration->note - used, "%s%s",
                 used > 0 ? "; " : "", note);
    }
    const int length = calibration_print(calibration, text->data, sizeof text->data);
    if (length < 0) {
        return command_fail(call, length, "the axes cannot be recorded: %s", error_text(length));
    }
    text->length = (size_t)length;
    *recorded = true;
    return ERROR_OK;
}

/// Checks a calibration of one state, and completes it with the axes.
static int check_one(const struct command_call *call, const char *name,
                     struct calibration_text *text, bool *recorded) {
    struct calibration calibration;
    struct message message;
    int error = calibration_at(name, text->data, text->length, &calibration, &message);
    if (error != ERROR_OK) {
        return command_fail(call, error, "%s", message.text);
    }
    error = check_match(call, &calibration, command_is_set(&call->values[ACCEPT]));
    if (error == ERROR_OK && !call->values[UNIT].given &&
        length_check_baseline(calibration_baseline_mm(&calibration), name,
                              "\"calibration set FILE unit=mm\" accepts it", &message) != 0) {
        return command_fail(call, ERROR_BASELINE, "%s", message.text);
    }
    return error == ERROR_OK ? record_axes(call, &calibration, text, recorded) : error;
}

/// Checks a zoom calibration: that it is of this instrument and its cameras.
static int check_zoom(const struct command_call *call, const char *name,
                      const struct calibration_text *text) {
    struct zoom_calibration *zoom;
    struct message message;
    int error = calibration_read_zoom(name, text->data, text->length, &zoom, &message);
    if (error != ERROR_OK) {
        return command_fail(call, error, "%s", message.text);
    }
    struct calibration of_rig;
    take_rig(zoom, &of_rig);
    free(zoom);
    error = check_match(call, &of_rig, command_is_set(&call->values[ACCEPT]));
    return error;
}

static int set_text(const struct command_call *call, const char *name,
                    struct calibration_text *text) {
    bool recorded = false;
    int error = zoom_calibration_is_text(text->data, text->length)
                    ? check_zoom(call, name, text)
                    : check_one(call, name, text, &recorded);
    if (error != ERROR_OK) {
        return error;
    }
    // First: alone it means nothing, and if it fails the calibration before is still the saved one.
    error = save_accepted(call, text, command_is_set(&call->values[ACCEPT]));
    if (error == ERROR_OK) {
        error = commands_store_save(call, STORE_CALIBRATION, text->data, text->length);
    }
    if (error != ERROR_OK) {
        return command_fail_store(call, error, "calibration", "save to");
    }
    reset_health(call);
    if (recorded) {
        reply_text(call, "axes", "recorded as they are now");
    }
    return show_text(call, name, text);
}

static int run_set(const struct command_call *call) {
    struct reading file = {.call = call, .name = call->values[FILE_NAME].text};
    file.text = malloc(sizeof *file.text);
    if (file.text == NULL) {
        return command_fail(call, ERROR_MEMORY, "calibration: out of memory");
    }
    disk_writer_run(&daemon_of(call)->disk_writer, read_job, &file);
    const int error = file.error != ERROR_OK ? file.error : set_text(call, file.name, file.text);
    free(file.text);
    return error;
}

static int run_forget(const struct command_call *call) {
    const int error = commands_store_remove(call, STORE_CALIBRATION);
    if (error == ERROR_MISSING) {
        return command_fail(call, error, "calibration: none saved");
    }
    return error == ERROR_OK ? ERROR_OK
                             : command_fail_store(call, error, "calibration", "remove from");
}

static int run_calibration(const struct command_call *call) {
    const struct hal_store *store = daemon_of(call)->store;
    const int what = call->values[WHAT].given ? call->values[WHAT].choice : SHOW;
    if (store == NULL) {
        return command_fail(call, ERROR_UNSUPPORTED,
                            "calibration: saving is disabled: \"store\" is not set");
    }
    if (what == SET && !call->values[FILE_NAME].given) {
        return command_fail(call, ERROR_MISSING,
                            "calibration: set requires FILE (\"files\" lists them)");
    }
    if (what != SET && call->values[FILE_NAME].given) {
        return command_fail(call, ERROR_ARGUMENT,
                            "calibration: unexpected FILE \"%s\" (only \"set\" has one)",
                            call->values[FILE_NAME].text);
    }
    if (what == SET) {
        return run_set(call);
    }
    return what == FORGET ? run_forget(call) : run_show(call);
}

static const struct command_argument arguments[] = {
    {.name = "WHAT",
     .kind = COMMAND_CHOICE,
     .choices = "show set forget",
     .optional = true,
     .help = "what to do; default: show"},
    {.name = "FILE",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = FILES_NAME_MAX,
     .optional = true,
     .help = "calibration to set, one of the instrument's files",
     .candidates = files_candidates_file},
    {.name = CAPTURE_ACCEPT_NAME,
     .kind = COMMAND_FLAG,
     .help = "accept one made with other axes, cameras or windows"},
    {.name = "unit",
     .kind = COMMAND_CHOICE,
     .choices = "mm",
     .help = "accept a baseline below 5 mm"},
};

static const struct command commands[] = {
    {.name = "calibration",
     .summary = "show, set or forget the saved calibration",
     .help = "It is saved across restarts. \"set\" rejects an invalid calibration, and, after a "
             "bring-up, one made with other axes, cameras or windows. One that states no axes, as "
             "those of other "
             "programs, is saved with the present ones, so that a later move is noticed. A "
             "calibration of all zooms "
             "gives each pair the calibration of its own zoom, focus and pan.",
     .arguments = arguments,
     .argument_count = ARGUMENTS,
     .flags = COMMAND_UNRECORDED | COMMAND_GROUP_MEASURE,
     .run = run_calibration},
};

const struct command *commands_calibration_table(size_t *count) {
    *count = 1;
    return commands;
}
